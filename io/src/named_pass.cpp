#include "trihedron/io/named_pass.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <system_error>

#include "directories.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

/// Number of bytes of the UTF-8 character at the front; 0 where there is none. Unicode, table 3-7.
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto is_between = [](unsigned value, unsigned low, unsigned high) { return low <= value && value <= high; };
  const auto follow = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      if (!is_between(byte(i), 0x80, 0xBF)) {
        return false;
      }
    }
    return true;
  };
  const unsigned first = byte(0);
  if (first < 0x80) {
    return text.empty() ? 0 : 1;
  }
  if (is_between(first, 0xC2, 0xDF)) {
    return follow(1, 2) ? 2 : 0;
  }
  if (is_between(first, 0xE0, 0xEF)) {
    const bool is_second = is_between(byte(1), first == 0xE0 ? 0xA0 : 0x80, first == 0xED ? 0x9F : 0xBF);
    return is_second && follow(2, 3) ? 3 : 0;
  }
  if (is_between(first, 0xF0, 0xF4)) {
    const bool is_second = is_between(byte(1), first == 0xF0 ? 0x90 : 0x80, first == 0xF4 ? 0x8F : 0xBF);
    return is_second && follow(2, 4) ? 4 : 0;
  }
  return 0;
}

/// The longest part of a text in whole characters that has at most this many bytes.
std::string cut(std::string_view text, std::size_t most) {
  std::size_t size = 0;
  for (std::size_t next = 0; next <= most; next += character_size(text.substr(size))) {
    size = next;
    if (size == text.size()) {
      break;
    }
  }
  return std::string(text.substr(0, size));
}

/// With "%1B" in place of a control character or of a byte that is not part of UTF-8.
std::string percent_encoded(std::string_view name) {
  std::string text;
  while (!name.empty()) {
    const auto first = static_cast<unsigned char>(name.front());
    const std::size_t size = character_size(name);
    const bool is_plain = size > 1 || (size == 1 && first >= 0x20 && first != 0x7F);
    text += is_plain ? std::string(name.substr(0, size)) : fmt::format("%{:02X}", first);
    name.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return text;
}

constexpr std::size_t kLongestName = 255;  // of a file, in bytes

std::string name_of_pass(const std::filesystem::path& path) {
  std::error_code fault;
  std::filesystem::path named = path.has_filename() ? path : path.parent_path();  // without a slash at the end
  if (named.filename() == "." || named.filename() == "..") {
    named = std::filesystem::canonical(path, fault);
  }
  const std::filesystem::path name = std::filesystem::is_directory(path, fault) ? named.filename() : named.stem();
  std::string text = cut(percent_encoded(name.string()), kLongestName);
  if (std::string_view(text).starts_with(kHidden)) {
    text.erase(0, 1);
  }
  return text.empty() ? "pass" : text;  // the root has no name
}

/// What is told of a star tracker by the time since an epoch, by that since a later one.
void move_epoch(double by_s, double orbital_rate_rad_s, Truth::StarTracker& its) {
  its.clock_offset_s += its.clock_rate_s_s * by_s;
  const double sine = std::sin(orbital_rate_rad_s * by_s);
  const double cosine = std::cos(orbital_rate_rad_s * by_s);
  const Eigen::Vector3d before = its.orbital_sine_rad;
  its.orbital_sine_rad = cosine * before - sine * its.orbital_cosine_rad;
  its.orbital_cosine_rad = sine * before + cosine * its.orbital_cosine_rad;
}

/// What lies between the ends of the selection by which the pass was read, counted from its epoch.
void keep_within(const Selection& selection, Duration epoch_moved, Truth& truth) {
  const auto begin = selection.from ? std::ranges::lower_bound(truth.t, *selection.from) : truth.t.begin();
  const auto end = selection.to ? std::ranges::upper_bound(truth.t, *selection.to) : truth.t.end();
  const std::ptrdiff_t first = begin - truth.t.begin();
  const std::ptrdiff_t last = std::max(end - truth.t.begin(), first);
  const auto keep = [&](auto& values, std::ptrdiff_t of_each) {
    values.erase(values.begin() + last * of_each, values.end());
    values.erase(values.begin(), values.begin() + first * of_each);
  };
  keep(truth.t, 1);
  keep(truth.q_in_c, 1);
  keep(truth.h_in, 3 * std::ssize(truth.gyros));
  for (Truth::StarTracker& head : truth.star_trackers) {
    move_epoch(to_seconds(epoch_moved), truth.orbital_rate_rad_s, head);
  }
}

std::optional<Truth> read_truth_of(const NamedPass& pass, const Selection& selection) {
  std::optional<Truth> truth = read_truth(pass.path);
  if (truth && truth->gyros.size() != static_cast<std::size_t>(pass.pass().gyro.gyros)) {
    throw InputRefused(
        pass.path, {},
        fmt::format("the truth has {} gyros, the telemetry {}", truth->gyros.size(), pass.pass().gyro.gyros),
        "give the truth of this pass, or none");
  }
  if (truth) {
    keep_within(selection, pass.loaded.epoch_moved, *truth);
    if (truth->t.empty()) {
      truth.reset();
    }
  }
  return truth;
}

}  // namespace

NamedPass read_named_pass(const std::filesystem::path& path, TruthUse use, const Selection& selection) {
  NamedPass named{path, name_of_pass(path), read_pass(path, selection), {}};
  try {
    named.truth = read_truth_of(named, selection);
  } catch (const InputIncomplete& refused) {
    if (use == TruthUse::kNeeded) {
      throw;
    }
    Defect defect;
    defect.kind = Defect::Kind::kTruthIncomplete;
    defect.where = fmt::format("{} ({})", percent_encoded(refused.file().filename().string()), refused.reason());
    defect.count = 1;
    named.loaded.defects.push_back(std::move(defect));
  }
  return named;
}

std::vector<NamedPass> read_passes(const std::vector<std::string>& paths, std::span<const std::string_view> reserved) {
  std::vector<NamedPass> passes;
  for (const std::string& path : paths) {
    passes.push_back(read_named_pass(path, TruthUse::kToCompare));
  }
  // A pass keeps its name unless one before it has it; a number leads to none that a later pass has of its own.
  std::set<std::string, std::less<>> own;
  for (const NamedPass& pass : passes) {
    own.insert(pass.name);
  }
  std::set<std::string, std::less<>> taken(reserved.begin(), reserved.end());
  for (NamedPass& pass : passes) {
    std::string name = pass.name;
    for (int number = 2; taken.contains(name) || (name != pass.name && own.contains(name)); ++number) {
      const std::string suffix = fmt::format("-{}", number);
      name = cut(pass.name, kLongestName - suffix.size()) + suffix;
    }
    taken.insert(name);
    pass.name = name;
  }
  std::ranges::stable_sort(passes, {}, [](const NamedPass& pass) { return pass.pass().settings.epoch; });
  return passes;
}

}  // namespace trihedron::io
