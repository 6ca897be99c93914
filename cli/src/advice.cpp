#include "advice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iterator>
#include <vector>

#include "summary.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

std::string sigma_text(const ground::Combination& combination, double sigma) {
  return combination.is_alignment ? angle_text(sigma) : figure("{:.1e} rad/s", sigma);
}

std::string slew_toml(const Slew& slew) {
  std::string text = fmt::format("{{begin = \"{}\"", io::format_duration(from_seconds(slew.begin_s)));
  for (const auto& [axis, angle_rad] :
       {std::pair{"roll", slew.roll_rad}, std::pair{"pitch", slew.pitch_rad}, std::pair{"yaw", slew.yaw_rad}}) {
    if (angle_rad != 0) {
      text += fmt::format(", {} = \"{}\"", axis, io::format_angle(angle_rad));
    }
  }
  return text + "}";
}

/// Why there are none, and the limit to widen where the flight needs some.
std::vector<std::string> why_no_slews(const plan::Advice& advice, const plan::SlewLimits& limits) {
  const std::string angle = io::format_angle(limits.max_angle_rad);
  const std::string none =
      fmt::format("No slews within these limits make the mean square of the attitude error smaller by {:.0f} %.",
                  100 * plan::Advice::kLeastGain);
  if (!advice.before.is_harmful()) {
    return {none, "The flight needs none: nothing that it leaves undetermined harms the attitude."};
  }
  return {none, limits.manoeuvre_time < advice.time_of_largest_slew
                    ? fmt::format("Give a longer --manoeuvre-time than {}: a slew of {}, there and back, takes {}.",
                                  io::format_duration(limits.manoeuvre_time), angle,
                                  io::format_duration(advice.time_of_largest_slew))
                    : fmt::format("Give a larger --max-angle than {}.", angle)};
}

}  // namespace

std::string advice_text(const plan::Advice& advice, const plan::SlewLimits& limits) {
  if (advice.slews().empty()) {
    return fmt::format("\nAdvice      {}\n", fmt::join(why_no_slews(advice, limits), "\n            "));
  }
  std::string text = fmt::format(
      "\nAdvice      {} slew{}, there and back; in the scenario\n\n[attitude]\nmax_slew_rate = \"{}\"\nslews = [\n",
      advice.slews().size() / 2, advice.slews().size() == 2 ? "" : "s",
      io::format_rate(advice.scenario.attitude.max_slew_rate_rad_s));
  auto out = std::back_inserter(text);
  for (const Slew& slew : advice.slews()) {
    fmt::format_to(out, "  {},\n", slew_toml(slew));
  }
  const auto row = [&](const std::string& before, const std::string& after, double times, const std::string& what) {
    fmt::format_to(out, "  {:>14} {:>14} {:>8} times   {}\n", before, after,
                   times < 10 ? figure("{:.1f}", times) : figure("{:.0f}", times), what);
  };
  fmt::format_to(out, "]\n\n  {:>14} {:>14} {:>14}\n", "1σ as it is", "with slews", "better");
  const double before_rad = advice.before.attitude_error_rad;
  const double after_rad = advice.after.attitude_error_rad;
  row(angle_text(before_rad), angle_text(after_rad), before_rad / after_rad, "attitude, as above");
  for (const plan::Advice::Gain& gain : advice.gains()) {
    row(sigma_text(gain.combination, gain.sigma_before), sigma_text(gain.combination, gain.sigma_after),
        gain.sigma_before / gain.sigma_after, gain.combination.text);
  }
  return text;
}

std::string confirmation_text(const plan::Confirmation& confirmation) {
  std::string text = fmt::format(
      "\nConfirmed   by {} simulated flights with the slews, calibrated by estimator batch\n  {:>14} {:>14}\n",
      confirmation.runs, "predicted 1σ", "simulated");
  auto out = std::back_inserter(text);
  for (const plan::Confirmation::Along& along : confirmation.along) {
    fmt::format_to(out, "  {:>14} {:>14}   {}\n", sigma_text(along.combination, along.predicted),
                   sigma_text(along.combination, along.simulated), along.combination.text);
  }
  fmt::format_to(out, "  simulated over predicted {}; mean NEES {} (expected {} ± {:.1f})\n",
                 figure("{:.2f}", confirmation.ratio), figure("{:.1f}", confirmation.nees), confirmation.parameters,
                 confirmation.nees_tolerance());
  if (confirmation.contradicts()) {
    text +=
        "  The flights CONTRADICT the prediction: the scenario may have what the settings leave out, as drift outside "
        "of drift_model.\n"
        "  → Leave drift_model and [further_states] to the program, or remove from the scenario drift that the real "
        "gyros do not have.\n";
  }
  return text;
}

nlohmann::ordered_json advice_json(const plan::Advice& advice, const plan::SlewLimits& limits,
                                   const std::optional<plan::Confirmation>& confirmation) {
  nlohmann::ordered_json json = {
      {"max_slew_rate_rad_s", advice.scenario.attitude.max_slew_rate_rad_s},
      {"slews", nlohmann::ordered_json::array()},
      {"attitude_error_rad",
       {{"before", advice.before.attitude_error_rad}, {"after", advice.after.attitude_error_rad}}},
      {"combinations", nlohmann::ordered_json::array()}};
  for (const Slew& slew : advice.slews()) {
    json["slews"].push_back({{"begin_s", slew.begin_s},
                             {"roll_rad", slew.roll_rad},
                             {"pitch_rad", slew.pitch_rad},
                             {"yaw_rad", slew.yaw_rad}});
  }
  if (advice.slews().empty()) {
    json["why_no_slews"] = fmt::format("{}", fmt::join(why_no_slews(advice, limits), " "));
  }
  for (const plan::Advice::Gain& gain : advice.gains()) {
    json["combinations"].push_back(
        {{"text", gain.combination.text}, {"sigma_before", gain.sigma_before}, {"sigma_after", gain.sigma_after}});
  }
  if (confirmation) {
    for (std::size_t i = 0; i < confirmation->along.size(); ++i) {
      json["combinations"][i]["sigma_simulated"] = confirmation->along[i].simulated;
    }
    json["confirmation"] = {{"runs", confirmation->runs},
                            {"simulated_over_predicted", confirmation->ratio},
                            {"nees", confirmation->nees},
                            {"parameters", confirmation->parameters},
                            {"contradicted", confirmation->contradicts()}};
  }
  return json;
}

}  // namespace trihedron::cli
