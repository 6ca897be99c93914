#include "proposals.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

using ground::Mistake;
using ground::SignedComponent;

Duration usual_step(const std::vector<Time>& t) {
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < t.size(); ++i) {
    steps.push_back(t[i] - t[i - 1]);
  }
  if (steps.empty()) {
    return {};
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// Columns in the order and with the signs of the components, as an array of TOML.
template <std::size_t Size>
std::string rearranged(const std::vector<std::string>& columns, const std::array<SignedComponent, Size>& components,
                       std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& name = columns[static_cast<std::size_t>(components[i].from)];
    const bool is_minus = name.starts_with('-');
    const std::string bare = is_minus ? name.substr(1) : name;
    names.push_back(fmt::format("\"{}{}\"", is_minus == (components[i].sign > 0) ? "-" : "", bare));
  }
  return fmt::format("[{}]", fmt::join(names, ", "));
}

/// What an arrangement of the first three components is, in words. `scalar_from`: where the fourth is; 3 of a
/// direction.
std::string arrangement_of_axes(std::span<const SignedComponent> components, int scalar_from) {
  constexpr std::string_view kAxes = "xyz";
  std::string moved;
  std::string mirrored;
  for (std::size_t i = 0; i < 3; ++i) {
    const int from = ground::axis_of(components[i], scalar_from);
    if (from != static_cast<int>(i)) {
      moved += fmt::format("{}{} is {}", moved.empty() ? "" : ", ", kAxes[static_cast<std::size_t>(from)], kAxes[i]);
    }
    if (components[i].sign < 0) {
      mirrored += fmt::format("{}{}", mirrored.empty() ? "" : ", ", kAxes[i]);
    }
  }
  std::vector<std::string> words;
  if (!moved.empty()) {
    words.push_back(fmt::format("axes in another order (what is told as {})", moved));
  }
  if (!mirrored.empty()) {
    words.push_back(fmt::format("mirrored along {}", mirrored));
  }
  return fmt::format("{}", fmt::join(words, " and "));
}

std::string words_for_quaternion(const Mistake& mistake) {
  std::array<SignedComponent, 4> components = mistake.components;
  std::vector<std::string> words;
  const int scalar_from = components[3].from;
  if (scalar_from != 3) {
    words.emplace_back(scalar_from == 0 ? "the scalar is the first component"
                                        : "the scalar is the last component, and told as the first");
  }
  const bool is_conjugate = std::all_of(components.begin(), components.begin() + 3,
                                        [](const SignedComponent& part) { return part.sign < 0; });
  if (is_conjugate) {
    words.emplace_back("they map inertial axes to those of the tracker (conjugate)");
    for (SignedComponent& part : components) {
      part.sign = 1;
    }
  }
  const std::string axes = arrangement_of_axes(components, scalar_from);
  if (!axes.empty()) {
    words.push_back(axes);
  }
  return fmt::format("quaternions of the fixes: {}", fmt::join(words, "; "));
}

std::string words_for(const Mistake& mistake) {
  switch (mistake.kind) {
    case Mistake::Kind::kQuaternion:
      return words_for_quaternion(mistake);
    case Mistake::Kind::kGyroAxes:
      return fmt::format("readings of gyro {}: {}", mistake.gyro + 1, arrangement_of_axes(mistake.components, 3));
    case Mistake::Kind::kGyrosExchanged:
      return "gyros 1 and 2 have each other's readings";
    case Mistake::Kind::kClock:
      return fmt::format("fixes were taken {:+.3f} s after their stamp", mistake.offset_s);
    case Mistake::Kind::kNothingTried:
      return "no usual mistake explains it: fixes of another pass or spacecraft, clocks more than ten minutes apart, "
             "or "
             "alignments further off than their prior sigmas say";
  }
  return "";
}

const char* code_of(Mistake::Kind kind) {
  switch (kind) {
    case Mistake::Kind::kQuaternion:
      return "quaternion";
    case Mistake::Kind::kGyroAxes:
      return "gyro-axes";
    case Mistake::Kind::kGyrosExchanged:
      return "gyros-exchanged";
    case Mistake::Kind::kClock:
      return "clock";
    case Mistake::Kind::kNothingTried:
      return "unexplained";
  }
  return "";
}

/// Of telemetry.toml or pass.toml; empty where no line mends it.
std::vector<std::string> lines_for(const Mistake& mistake, const io::LoadedPass& loaded) {
  const io::ColumnsRead& columns = loaded.columns;
  switch (mistake.kind) {
    case Mistake::Kind::kQuaternion:
      return {"[telemetry.star_tracker]",
              fmt::format("quaternion = {}", rearranged(columns.quaternion, mistake.components, 4)),
              "scalar = \"last\"", "maps = \"tracker-to-inertial\""};
    case Mistake::Kind::kGyroAxes:
      return {fmt::format("[[telemetry.gyro.unit]]  # gyro {}", mistake.gyro + 1),
              fmt::format("direction = {}", rearranged(columns.directions[static_cast<std::size_t>(mistake.gyro)],
                                                       mistake.components, 3))};
    case Mistake::Kind::kGyrosExchanged: {
      constexpr std::array<SignedComponent, 4> kAsTold = {{{0, 1}, {1, 1}, {2, 1}, {3, 1}}};
      return {"[[telemetry.gyro.unit]]  # gyro 1",
              fmt::format("direction = {}", rearranged(columns.directions[1], kAsTold, 3)),
              "[[telemetry.gyro.unit]]  # gyro 2",
              fmt::format("direction = {}", rearranged(columns.directions[0], kAsTold, 3))};
    }
    case Mistake::Kind::kClock:
      return {"[star_tracker]", fmt::format("clock_offset_s = {:.3f}",
                                            loaded.pass.settings.star_tracker_clock_offset_s + mistake.offset_s)};
    case Mistake::Kind::kNothingTried:
      break;
  }
  return {};
}

}  // namespace

Periods periods_of(const Pass& pass) {
  return {pass.settings.gyro_period, usual_step(pass.gyro.t), pass.settings.star_tracker_period,
          usual_step(pass.star_tracker.t)};
}

std::string periods_text(const Periods& periods) {
  return fmt::format("Periods     gyros {:.6g} s, told {:.6g} s; fixes {:.6g} s, told {:.6g} s\n",
                     to_seconds(periods.gyro), to_seconds(periods.gyro_told), to_seconds(periods.star_tracker),
                     to_seconds(periods.star_tracker_told));
}

nlohmann::ordered_json periods_json(const Periods& periods) {
  return {{"gyro_s", to_seconds(periods.gyro)},
          {"gyro_told_s", to_seconds(periods.gyro_told)},
          {"star_tracker_s", to_seconds(periods.star_tracker)},
          {"star_tracker_told_s", to_seconds(periods.star_tracker_told)}};
}

std::string consistency_text(const std::optional<ground::Consistency>& consistency, const io::LoadedPass& loaded) {
  if (!consistency) {
    return "Together    not shown: too few fixes with readings beside them\n";
  }
  std::string text = "Together    momenta move by";
  for (int k = 0; k < loaded.pass.gyro.gyros; ++k) {
    text += fmt::format("{} {:.2f}°", k == 0 ? "" : ",", degrees(consistency->motion_rad[k]));
  }
  text += " in inertial axes within 20 min; alignments and drift explain up to";
  for (int k = 0; k < loaded.pass.gyro.gyros; ++k) {
    text += fmt::format("{} {:.2f}°", k == 0 ? "" : ",", degrees(consistency->allowed_rad[k]));
  }
  text += '\n';
  const std::vector<Mistake>& mistakes = consistency->mistakes;
  if (mistakes.size() > 1) {
    text += "Mistake     one of these would explain it, and this pass does not tell which:\n";
    for (const Mistake& mistake : mistakes) {
      text += fmt::format("            {}\n", words_for(mistake));
    }
  } else if (mistakes.size() == 1) {
    text += fmt::format("Mistake     {}\n", words_for(mistakes.front()));
    if (std::isfinite(mistakes.front().motion_rad)) {
      text += fmt::format("            Mended, momenta move by {:.2f}°. The lines for it, in telemetry.toml{}:\n",
                          degrees(mistakes.front().motion_rad),
                          mistakes.front().kind == Mistake::Kind::kClock ? " or pass.toml" : "");
    }
    for (const std::string& line : lines_for(mistakes.front(), loaded)) {
      text += fmt::format("              {}\n", printable(line));
    }
  }
  return text;
}

nlohmann::ordered_json consistency_json(const std::optional<ground::Consistency>& consistency,
                                        const io::LoadedPass& loaded) {
  if (!consistency) {
    return nullptr;
  }
  nlohmann::ordered_json json = {{"consistent", consistency->is_consistent},
                                 {"motion_rad", nlohmann::ordered_json::array()},
                                 {"allowed_rad", nlohmann::ordered_json::array()},
                                 {"mistakes", nlohmann::ordered_json::array()},
                                 {"proposal", nlohmann::ordered_json::array()}};
  for (int k = 0; k < loaded.pass.gyro.gyros; ++k) {
    json["motion_rad"].push_back(consistency->motion_rad[k]);
    json["allowed_rad"].push_back(consistency->allowed_rad[k]);
  }
  for (const Mistake& mistake : consistency->mistakes) {
    json["mistakes"].push_back(
        {{"kind", code_of(mistake.kind)}, {"text", words_for(mistake)}, {"motion_rad", mistake.motion_rad}});
  }
  if (consistency->mistakes.size() == 1) {
    json["proposal"] = lines_for(consistency->mistakes.front(), loaded);
  }
  return json;
}

}  // namespace trihedron::cli
