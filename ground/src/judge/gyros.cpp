#include "judge/gyros.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "judge/findings.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

/// Degree of the polynomial through the samples round a fix.
constexpr int kCubic = 3;
constexpr double kBadlyPlacedSine = 0.5;

/// The events by which gyros were left out for good, or until the end of the pass.
std::vector<GyroEvent> losses(const std::vector<GyroEvent>& events, Time end) {
  constexpr Duration kForMore = std::chrono::minutes(5);
  PerGyro<GyroEvent> last{};
  for (const GyroEvent& event : events) {
    last[event.gyro] = event;
  }
  std::vector<GyroEvent> lost;
  std::ranges::copy_if(last, std::back_inserter(lost), [&](const GyroEvent& event) {
    const bool is_off = event.state == GyroState::kStuck || event.state == GyroState::kLeapt;
    return event.state == GyroState::kIsolated || (is_off && end - event.t > kForMore);
  });
  return lost;
}

/// Whether the sample of this event has no reading of its gyro, or none that is a direction.
bool is_silent(const GyroTelemetry& telemetry, const GyroEvent& event) {
  const auto i = static_cast<std::size_t>(std::ranges::find(telemetry.t, event.t) - telemetry.t.begin());
  return i < telemetry.size() && !nearly_unit(telemetry.direction(i, event.gyro).norm());
}

struct TextAndCure {
  const char* text;
  const char* cure;
};

/// Of gyros that were stuck, by their readings at these events.
TextAndCure of_stuck(const GyroTelemetry& telemetry, const std::vector<GyroEvent>& events,
                     const std::vector<GyroEvent>& lost) {
  const auto is_stuck = [](const GyroEvent& event) { return event.state == GyroState::kStuck; };
  const auto stuck = std::ranges::count_if(events, is_stuck);
  const auto silent = std::ranges::count_if(
      events, [&](const GyroEvent& event) { return is_stuck(event) && is_silent(telemetry, event); });
  if (silent == 0) {
    return {"Readings of a gyro, or one component of them, stood still, not even moved by noise; they were not used.",
            "Look at the telemetry there: a frozen readout, or the last value repeated in a gap."};
  }
  if (silent < stuck) {
    return {
        "At some times readings of a gyro, or one component of them, stood still, not even moved by noise; at others "
        "there were none, or none that are a direction. It was not used there.",
        "Look at the telemetry there: a frozen readout, the last value repeated in a gap, a gyro that was off."};
  }
  const bool is_off = std::ranges::any_of(events, [&](const GyroEvent& event) {
    return is_stuck(event) && std::ranges::any_of(lost, [&](const GyroEvent& its) { return its.gyro == event.gyro; });
  });
  return {is_off ? "A gyro gives no readings any more, or none that are a direction."
                 : "For a while a gyro gave no readings, or none that are a direction; it was not used there.",
          is_off ? "Look for why it is off; the part of the pass before can be used." : "Look for why it was off."};
}

}  // namespace

void judge_gyros(const Pass& pass, const std::vector<GyroEvent>& gyro_events, int gyros, const char* without_pair,
                 std::vector<Finding>& findings) {
  const std::vector<GyroEvent> lost = losses(gyro_events, pass.gyro.t.back());
  const bool has_pair = has_pair_at_end(gyro_events, gyros, pass.gyro.t.back());
  const auto add_events = [&](GyroState state, FindingCode code, std::string text, const char* cure) {
    const auto is_of_state = [&](const GyroEvent& event) { return event.state == state; };
    std::vector<GyroEvent> events;
    std::ranges::copy_if(gyro_events, std::back_inserter(events), is_of_state);
    if (events.empty()) {
      return;
    }
    const bool breaks_pair = !has_pair && std::ranges::any_of(lost, is_of_state);
    text += breaks_pair ? without_pair : "";
    add(findings, code, std::move(text), fmt::format("{}", fmt::join(texts_of(events, pass.settings.epoch), "; ")),
        cure);
    if (breaks_pair) {
      findings.back().severity = Severity::kDoNotUse;
    }
  };
  add_events(GyroState::kIsolated, FindingCode::kGyroIsolated,
             "A gyro alone did not agree with the rest, time after time, and was left out.",
             "Look at its telemetry from there on.");
  const TextAndCure stuck = of_stuck(pass.gyro, gyro_events, lost);
  add_events(GyroState::kStuck, FindingCode::kGyroStuck, stuck.text, stuck.cure);
  add_events(GyroState::kLeapt, FindingCode::kGyroLeapt,
             "Readings of a gyro leapt farther than a body turns from one sample to the next; they were not used until "
             "they were back, or for an hour.",
             "Look at the telemetry there: columns or gyros exchanged, a sign, samples of another time.");
}

void judge_gyro_rate(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const double period_s = to_seconds(pass.settings.gyro_period);
  if (const long thinned = run.samples[SampleStatus::kThinned]; thinned > 0) {
    add(findings, FindingCode::kGyroSamplesThinned,
        fmt::format(
            "The gyros were sampled faster than the calibration uses: up to {} samples per second are used, the "
            "others were left out.",
            std::chrono::seconds(1) / Readings<2>::kMinSpacing),
        fmt::format("{} of {} samples left out; sampled every {:.3g} s", thinned, pass.gyro.size(), period_s),
        "Send fewer of them where that saves telemetry: the calibration is the same.");
  }
  CalibrationSetup setup;
  const Duration usual_reach = setup.reach();
  setup.gyro_period = pass.settings.gyro_period;
  if (const Duration reach = setup.reach(); reach > usual_reach) {
    const bool interpolates = run.options.estimator == Estimator::kPaper;
    add(findings, FindingCode::kGyroSamplesFarApart,
        "The gyro samples are far apart: what the gyros read at the time of a fix is taken from samples further away, "
        "which limits the accuracy while the body accelerates.",
        interpolates
            ? fmt::format("interpolated between samples {:.3g} s apart", period_s)
            : fmt::format("sampled every {:.3g} s, so that a cubic is fitted over ±{:.3g} s instead of ±{:.3g} s",
                          period_s, to_seconds(reach), to_seconds(usual_reach)),
        fmt::format("Sample the gyros every {:.3g} s or more often.",
                    2 * to_seconds(usual_reach) / DirectionsFit::least_samples(kCubic)));
    // A warning of what may be; here it is, and the attitude is off as the fixes are, which is in no sigma.
    if (std::ranges::find(findings, FindingCode::kFixesWorseInSlews, &Finding::code) != findings.end()) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
}

void judge_bursts(const std::optional<Bursts>& bursts, std::vector<Finding>& findings) {
  if (!bursts) {
    return;
  }
  const std::string what =
      "For moments of up to some seconds the readings of a gyro were wrong: the angle between the momenta left its "
      "course and came back. ";
  add(findings, FindingCode::kGyroReadingsWrong,
      what + (bursts->left_out ? "These samples were left out. Where the readings were off across that angle it does "
                                 "not show, and the attitude there is off with them."
                               : "They are in the attitude."),
      fmt::format("{} times, {} samples; the angle was off by up to {}", bursts->bursts, bursts->samples,
                  angle_text(bursts->largest_rad)),
      bursts->left_out
          ? "Look for what disturbs the readout: charging, saturation, telemetry that mixes packets."
          : "Look for what disturbs the readout, and leave these parts out of the telemetry. A calibration "
            "leaves them out where they are few; a navigation, which does not know yet that they come "
            "back, does not.");
  if (!bursts->left_out) {
    findings.back().severity = Severity::kDoNotUse;
  }
}

void judge_readout_noise(const std::optional<ReadoutNoise>& noise, std::vector<Finding>& findings) {
  if (noise) {
    const auto text = [&](const PerGyro<double>& noise_rad) {
      std::string all;
      for (int k = 0; k < noise->gyros; ++k) {
        all += fmt::format("{}{:.2g}″", k == 0 ? "" : " ", noise_rad[k] / kArcsecond);
      }
      return all;
    };
    const double lasting = *std::max_element(noise->lasting.begin(), noise->lasting.begin() + noise->gyros);
    add(findings, FindingCode::kReadoutNoise,
        "The readings of the gyros do not scatter as pass.toml says; the noise found was used.",
        fmt::format("{} found{}, up to {} for an hour{}, {} in pass.toml", text(noise->found_rad),
                    lasting > 1
                        ? fmt::format(", {:.1f} times what single readings show, since their noise lasts", lasting)
                        : "",
                    text(noise->most_rad),
                    noise->in_slews >= 1.05 ? fmt::format(", {:.1f} times as much in slews", noise->in_slews) : "",
                    text(noise->told_rad)),
        noise->is_steady() ? "Correct the noise figures of the gyros in pass.toml."
                           : "Look for what makes the readings noisier in slews or for a part of the pass: there the "
                             "attitude is worse than its sigmas. Cut such a part off.");
    if (!noise->is_steady()) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
}

void judge_pair(const CalibrationRun& run, std::vector<Finding>& findings) {
  const auto angle = angle_between<double>(run.calibration.gyros[0].momentum_in, run.calibration.gyros[1].momentum_in);
  if (std::sin(angle) < kBadlyPlacedSine) {
    add(findings, FindingCode::kPairBadlyPlaced,
        "The momenta lie within 30° of one line: the attitude about them is worse than the readout by 1/sinθ.",
        fmt::format("angle {:.1f}°, factor {:.1f}", angle * 180 / std::numbers::pi, 1 / std::sin(angle)),
        "Start one rotor along another axis.");
  }
}

bool has_pair_at_end(const std::vector<GyroEvent>& gyro_events, int gyros, Time end) {
  return gyros >= static_cast<int>(losses(gyro_events, end).size()) + 2;
}

std::vector<std::string> texts_of(const std::vector<GyroEvent>& events, Time epoch) {
  struct Seen {
    long times = 0;
    Time first{};
  };
  std::map<std::pair<int, GyroState>, Seen> seen;
  for (const GyroEvent& event : events) {
    Seen& its = seen[{event.gyro, event.state}];
    its.first = its.times++ == 0 ? event.t : its.first;
  }
  std::vector<std::string> texts;
  for (const auto& [what, its] : seen) {
    const double minutes = to_seconds(its.first - epoch) / 60;
    texts.push_back(fmt::format("gyro {} {}{} {:.1f} min", what.first + 1, name_of(what.second),
                                its.times > 1 ? fmt::format(" {} times, first at", its.times) : " at", minutes));
  }
  return texts;
}

}  // namespace trihedron::ground
