#include "judge/clocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "judge/findings.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/attitude.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::ground {
namespace {

constexpr double kSigmasToTell = 5;
/// From here on an offset is more than a state can hold (its prior sigma is 0.1 s), …
constexpr double kTooFar_s = 0.3;
/// … a change of it over the pass is seen, or is more than the attitude should suffer: at 0.5 deg/s 20 ms are 36″, …
constexpr double kSeenChange_s = 0.01;
constexpr double kTooMuchChange_s = 0.05;
/// … and so is a gyro that is late against another.
constexpr double kSeenLate_s = 2e-3;
constexpr double kTooLate_s = 0.01;
/// Alignments follow the mean of two heads that are apart by so much, by several of their sigmas.
constexpr double kHeadsTooFar_s = 4e-3;
/// Both clocks of a pair are off that of the star tracker by more than this: which of them is right is not told.
constexpr double kNoneAlike_s = 5e-3;
/// In orbital motion such stamps move a reading by the noise of the paper's gyros.
constexpr double kTooScattered_s = 0.01;
/// Where nothing is estimated of it, the attitude of a navigation is off by what the body turns in it, in sigmas.
constexpr double kSeenTurned = 1;
constexpr double kTooFarTurned = 2;

/// Where the calibration in use had something to say of them.
constexpr const char* kAfterCorrection = " though they were corrected as the calibration in use says";
constexpr const char* kCureAfterCorrection =
    "The clocks are no longer as the calibration found them: calibrate on this pass, or take \"clocks\" out of the "
    "file where the stamps are right by now.";
constexpr const char* kWhichClock =
    "The two clocks alone do not tell which of them is wrong; times given are those of the gyros.";

/// The line of pass.toml that mends the stamps; what it says already is in them.
std::string cure_of_star_tracker(const PassSettings& settings, double offset_s, double rate_s_s) {
  const double rate = settings.star_tracker_clock_rate_s_s + rate_s_s;
  return fmt::format(
      "Correct the stamps of the star tracker, or say in pass.toml, [star_tracker]: clock_offset_s = {:.4f}{}.",
      settings.star_tracker_clock_offset_s + offset_s, rate == 0 ? "" : fmt::format(", clock_rate_s_s = {:.4g}", rate));
}

std::string offset_text(double offset_s) {
  return std::abs(offset_s) < 1 ? fmt::format("{:+.2f} ms", 1e3 * offset_s) : fmt::format("{:+.4f} s", offset_s);
}

/// The value of a shared state of one component, where it is known to be there.
double sure_value_of(const CalibrationRun& run, FurtherState state) {
  for (const FurtherEstimate& estimate : run.calibration.further) {
    if (estimate.parameter.is_further(state) && std::abs(estimate.value) >= kSigmasToTell * estimate.sigma) {
      return estimate.value;
    }
  }
  return 0;
}

void judge_late_gyros(const PassSettings& settings, const Clocks& clocks, const PerGyro<double>& late_s,
                      std::vector<Finding>& findings, Finding::Severity severity, const char* what_of_it) {
  for (int k = 0; k < static_cast<int>(settings.gyros.size()); ++k) {
    if (late_s[k] == 0) {
      continue;
    }
    const GyroPrior& prior = settings.gyros[static_cast<std::size_t>(k)];
    const bool late = late_s[k] > 0;
    add(findings, FindingCode::kGyroLate, severity,
        fmt::format("The readings of gyro {} are stamped {} against those of gyro {}{}.", k + 1,
                    late ? "late" : "early", clocks.reference + 1, what_of_it),
        fmt::format("{:+.2f} ± {:.2f} ms", 1e3 * late_s[k], 1e3 * clocks.late_s[k].sigma),
        fmt::format("Correct its stamps, or say in pass.toml, which then needs a [[gyro.unit]] for each gyro, in that "
                    "of gyro {}: "
                    "latency_s = {:.5f}.",
                    k + 1, prior.latency_s + late_s[k]));
  }
}

/// By how much the stamps of a gyro whose clock runs at another rate are off at the ends of the pass; 0 where that is
/// not seen.
double late_at_the_ends_s(const PassSettings& settings, const Measured& rate) {
  const double farthest_s = to_seconds(settings.duration) / 2 * std::abs(rate.value);
  return rate.is_sure(kSigmasToTell) && farthest_s > kSeenLate_s ? farthest_s : 0;
}

bool has_gyro_of_another_rate(const PassSettings& settings, const std::optional<Clocks>& clocks) {
  bool has_one = false;
  for (int k = 0; clocks && k < static_cast<int>(settings.gyros.size()); ++k) {
    has_one = has_one || late_at_the_ends_s(settings, clocks->late_rate_s_s[k]) > 0;
  }
  return has_one;
}

/// The middle of the pass, in which the clocks are compared.
Time middle_of(const Pass& pass) {
  const std::vector<Time>& fixes = pass.star_tracker.t;
  return std::chrono::round<std::chrono::seconds>(fixes.front() + (fixes.back() - fixes.front()) / 2);
}

/// Gyros whose clocks run at another rate, which nothing corrects: what the ends of the pass are off by is forbidden
/// from `too_late_s` on. The cure leaves what they are late in the middle, which is told as well.
void judge_gyro_rates(const Pass& pass, const Clocks& clocks, double too_late_s, std::vector<Finding>& findings) {
  const PassSettings& settings = pass.settings;
  for (int k = 0; k < static_cast<int>(settings.gyros.size()); ++k) {
    const Measured& rate = clocks.late_rate_s_s[k];
    if (const double farthest_s = late_at_the_ends_s(settings, rate); farthest_s > 0) {
      add(findings, FindingCode::kGyroClockRate,
          farthest_s > too_late_s ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
          fmt::format(
              "The clock of gyro {} runs at another rate than that of gyro {}; the estimates take its lateness for "
              "constant.",
              k + 1, clocks.reference + 1),
          fmt::format(
              "{:+.3g} ± {:.2g} ppm: at the ends of the pass its stamps are {:.1f} ms later and earlier than in the "
              "middle",
              1e6 * rate.value, 1e6 * rate.sigma, 1e3 * farthest_s),
          fmt::format("Subtract {:.4g} (t - {}) from the stamps of gyro {}, or calibrate shorter passes.", rate.value,
                      iso_time(middle_of(pass)), k + 1));
    }
  }
}

/// Of the gyros of a pair one is late against the other, and that one against the star tracker: of three clocks no two
/// agree. `late_s`: of which 0 is not there; `offset_s`: of the star tracker against the gyro that is not late.
bool do_no_two_agree(const PassSettings& settings, const PerGyro<double>& late_s, double offset_s) {
  return settings.gyros.size() == 2 && std::abs(offset_s) > kNoneAlike_s &&
         std::max(std::abs(late_s[0]), std::abs(late_s[1])) > kNoneAlike_s;
}

/// `before`: findings that there were before those of the late gyros.
void forbid_late_gyros(std::vector<Finding>& findings, std::size_t before, double offset_s) {
  for (std::size_t i = before; i < findings.size(); ++i) {
    findings[i].severity = Finding::Severity::kDoNotUse;
    findings[i].text +=
        " The clock of the star tracker agrees with neither of the two: which gyro is stamped wrongly, the "
        "pass does not tell.";
    findings[i].evidence += fmt::format("; fixes were taken {} after their stamp", offset_text(offset_s));
    findings[i].cure = "Find out which of the three clocks is right before any is corrected. " + findings[i].cure;
  }
}

/// A clock that is off by more or less over a part of the pass. `what_of_it`: what becomes of that.
void judge_step(const Pass& pass, const ClockStep& step, Finding::Severity severity, const char* what_of_it,
                std::vector<Finding>& findings) {
  const auto minutes = [&](Time t) { return std::lround(to_seconds(t - pass.settings.epoch) / 60); };
  const double more_s = step.change_s.value;
  const std::string size = fmt::format("{} ± {:.2f} ms", offset_text(more_s), 1e3 * step.change_s.sigma);
  const bool of_star_tracker = step.gyro < 0;
  const std::string whose = of_star_tracker ? "the star tracker" : fmt::format("gyro {}", step.gyro + 1);
  add(findings, FindingCode::kClockStepped, severity,
      fmt::format("Between {} and {} min the clock of {} is off by another amount than over the rest of the pass{}.",
                  minutes(step.from), minutes(step.until), whose, what_of_it),
      fmt::format("there {} later than over the rest, by {}", of_star_tracker ? "fixes were taken" : "its stamps are",
                  size),
      fmt::format(
          "Add {:+.4f} s to the stamps of {} there, or cut the pass there and calibrate on the parts apart; look "
          "for what happened to its clock.",
          of_star_tracker ? more_s : -more_s, whose));
}

/// What the navigation corrected by the calibration in use.
void tell_correction(const PassSettings& settings, const ClockCorrection& correction, std::vector<Finding>& findings) {
  constexpr const char* kCure = "Calibrate again when a clock has been set.";
  if (correction.of_star_tracker()) {
    const double change_s = correction.rate_s_s * to_seconds(settings.duration);
    add(findings, FindingCode::kClockOffsetFound, Finding::Severity::kNote,
        "The stamps of the star tracker were corrected by what the calibration in use found of its clock.",
        fmt::format("fixes were taken {} after their stamp at the epoch of this pass; over the pass that "
                    "changes by {}",
                    offset_text(correction.offset_s), offset_text(change_s)),
        kCure);
  }
  for (int k = 0; k < static_cast<int>(settings.gyros.size()); ++k) {
    if (correction.late_s[k] != 0) {
      add(findings, FindingCode::kGyroLate, Finding::Severity::kNote,
          fmt::format("The readings of gyro {} were interpolated by what the calibration in use found of its stamps.",
                      k + 1),
          fmt::format("{:+.2f} ms", 1e3 * correction.late_s[k]), kCure);
    }
  }
}

/// `late_s`: what all of them were taken to be late. `what_then`: what became of it.
void judge_gyro_stamps(double off_s, double late_s, Finding::Severity severity, const char* what_then,
                       std::vector<Finding>& findings) {
  if (off_s > 0) {
    add(findings, FindingCode::kGyroStampsScatter, severity,
        fmt::format("The stamps of the gyro samples scatter about regular times, at which the readings were taken{}.",
                    what_then),
        fmt::format("{:.1f} ms (root mean square){}", 1e3 * off_s,
                    late_s == 0
                        ? std::string()
                        : fmt::format("; beside this all were taken to be {:+.1f} ms late, as the star tracker says",
                                      1e3 * late_s)),
        "Stamp the samples when they are taken, not when they are sent or received.");
  }
}

/// Star trackers whose clocks are not that of the first: a state has one offset for all.
void judge_further_star_trackers(const std::vector<Measured>& apart_s, std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < apart_s.size(); ++i) {
    const double its_s = apart_s[i].value;
    if (apart_s[i].is_sure(kSigmasToTell) && std::abs(its_s) > kSeenLate_s) {
      add(findings, FindingCode::kClocksApart,
          std::abs(its_s) > kHeadsTooFar_s ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
          fmt::format("The stamps of star tracker {} are off those of the first; the calibration takes the clocks of "
                      "both for one.",
                      i + 2),
          fmt::format("its fixes were taken later after their stamp, by {:+.2f} ± {:.2f} ms", 1e3 * its_s,
                      1e3 * apart_s[i].sigma),
          fmt::format("Add {:+.4f} s to the stamps of star tracker {}, or correct those of the first.", its_s, i + 2));
    }
  }
}

/// By how many sigmas of the attitude the body turns in this time: the median over the pass, since a correction is
/// seldom made in a slew.
double turned_in_sigmas(const AttitudeHistory& attitude, double time_s) {
  constexpr Duration kShort = std::chrono::seconds(3);  // noise of the readings makes no rate over it
  std::vector<double> sigmas;
  std::size_t last = 0;
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    const Duration since = attitude.t[i] - attitude.t[last];
    if (since < kShort) {
      continue;
    }
    const Eigen::Quaterniond turn = attitude.q_in_c[last].conjugate() * attitude.q_in_c[i];
    const Eigen::Vector3d turned_rad = Rot<C, C>::assume(turn).log().raw() * (time_s / to_seconds(since));
    const double in_sigmas = turned_rad.cwiseQuotient(attitude.sigma_rad[i]).norm();
    if (std::isfinite(in_sigmas)) {
      sigmas.push_back(in_sigmas);
    }
    last = i;
  }
  return sigmas.empty() ? 0 : median_of(sigmas);
}

}  // namespace

void judge_clocks(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  judge_gyro_stamps(run.gyro_stamps_off_s, run.gyro_stamps_late_s, Finding::Severity::kWarning,
                    "; the calibration has used these times", findings);
  const ClockCorrection& correction = run.clock_correction;
  const bool corrected = correction.of_star_tracker();
  double offset_s = sure_value_of(run, FurtherState::kClockOffset);
  double rate = sure_value_of(run, FurtherState::kClockRate);
  // Estimator paper has no states for them, and those of the others follow a gyro that runs at another rate.
  const bool follows_gyro = has_gyro_of_another_rate(pass.settings, run.clocks);
  if (follows_gyro || (offset_s == 0 && rate == 0 && corrected)) {
    offset_s = correction.offset_s;
    rate = correction.rate_s_s;
  }
  const auto severity = corrected ? Finding::Severity::kWarning : Finding::Severity::kNote;
  const std::string cure = cure_of_star_tracker(pass.settings, offset_s, rate);
  if (offset_s != 0) {
    add(findings, FindingCode::kClockOffsetFound, severity,
        corrected ? fmt::format("The stamps of the star tracker are far off those of the gyros; the calibration has "
                                "taken account of it. {}",
                                kWhichClock)
                  : "The clock of the star tracker is off that of the gyros; the calibration has taken account of it.",
        fmt::format("fixes were taken {} after their stamp", offset_text(offset_s)), cure);
  }
  if (rate != 0) {
    add(findings, FindingCode::kClockRateFound, severity,
        fmt::format("The clocks of star tracker and gyros run at different rates; the calibration has taken account of "
                    "it. {}",
                    kWhichClock),
        fmt::format("{:+.4g} ppm: the stamps of the star tracker {} by {:.3g} ms an hour", 1e6 * rate,
                    rate > 0 ? "fall behind" : "gain", 3.6e6 * std::abs(rate)),
        cure);
  }
  if (run.corrected_step) {
    judge_step(pass, *run.corrected_step, Finding::Severity::kWarning, "; the calibration has taken account of it",
               findings);
  }
  if (!run.clocks) {
    return;
  }
  judge_further_star_trackers(run.clocks->further_star_trackers_s, findings);
  if (run.clocks->step) {
    const bool is_wrong = std::abs(run.clocks->step->change_s.value) > kTooLate_s;
    judge_step(pass, *run.clocks->step, is_wrong ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
               "; the estimates take it for constant", findings);
  }
  const Measured& middle = run.clocks->mid_offset_s;
  judge_gyro_rates(pass, *run.clocks, kSeenLate_s, findings);
  const std::size_t before = findings.size();
  judge_late_gyros(pass.settings, *run.clocks, correction.late_s, findings, Finding::Severity::kWarning,
                   "; the calibration has interpolated them");
  const double found_s = middle.is_sure(kSigmasToTell) ? middle.value : offset_s;
  if (do_no_two_agree(pass.settings, correction.late_s, found_s)) {
    forbid_late_gyros(findings, before, found_s);
  }
  if (!corrected && middle.is_sure(kSigmasToTell) && std::abs(middle.value) > kTooFar_s) {
    add(findings, FindingCode::kClocksApart, Finding::Severity::kDoNotUse,
        fmt::format(
            "The stamps of the star tracker are far off those of the gyros, and by the settings nothing was done "
            "about it. {}",
            kWhichClock),
        fmt::format("fixes were taken {} after their stamp", offset_text(middle.value)),
        cure_of_star_tracker(pass.settings, middle.value, 0));
  }
}

void judge_clocks(const Pass& pass, const NavigationRun& run, std::vector<Finding>& findings) {
  const bool corrected = run.clock_correction.of_star_tracker() || run.clock_correction.of_gyros();
  tell_correction(pass.settings, run.clock_correction, findings);
  const bool too_scattered = run.gyro_stamps_off_s > kTooScattered_s;
  judge_gyro_stamps(run.gyro_stamps_off_s, 0,
                    too_scattered ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
                    ", which is in the attitude", findings);
  if (!run.clocks) {
    return;
  }
  const Clocks& clocks = *run.clocks;
  if (clocks.step) {
    const bool is_wrong = std::abs(clocks.step->change_s.value) > kTooMuchChange_s;
    judge_step(pass, *clocks.step, is_wrong ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
               ", which is in the attitude", findings);
  }
  const Measured& middle = clocks.mid_offset_s;
  const double change_s =
      clocks.rate_s_s.is_sure(kSigmasToTell) ? clocks.rate_s_s.value * to_seconds(pass.settings.duration) : 0;
  const bool is_sure = middle.is_sure(kSigmasToTell);
  const bool far = is_sure && std::abs(middle.value) > kTooFar_s;
  const double turned_sigmas = is_sure && !run.has_clock_state ? turned_in_sigmas(run.attitude, middle.value) : 0;
  if (far || std::abs(change_s) > kSeenChange_s || turned_sigmas > kSeenTurned) {
    const bool wrong = far || std::abs(change_s) > kTooMuchChange_s || turned_sigmas > kTooFarTurned;
    const Measured& at_epoch = change_s == 0 ? middle : clocks.offset_s;
    add(findings, FindingCode::kClocksApart, wrong ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
        fmt::format("The stamps of the star tracker are off those of the gyros{}, which is in the attitude. {}",
                    corrected ? kAfterCorrection : "", kWhichClock),
        fmt::format("fixes were taken {} after their stamp in the middle of the pass; over the pass that changes "
                    "by {}{}",
                    offset_text(middle.value), offset_text(change_s),
                    turned_sigmas > kSeenTurned
                        ? fmt::format("; in that time the body turns by {:.1f} sigmas of the attitude", turned_sigmas)
                        : ""),
        corrected ? kCureAfterCorrection
                  : cure_of_star_tracker(pass.settings, at_epoch.value, change_s == 0 ? 0 : clocks.rate_s_s.value));
  }
  PerGyro<double> late_s{};
  double latest_s = 0;
  for (int k = 0; k < static_cast<int>(pass.settings.gyros.size()); ++k) {
    const Measured& its = clocks.late_s[k];
    late_s[k] = its.is_sure(kSigmasToTell) && std::abs(its.value) > kSeenLate_s ? its.value : 0;
    latest_s = std::max(latest_s, std::abs(late_s[k]));
  }
  judge_gyro_rates(pass, clocks, kTooLate_s, findings);
  const std::size_t before = findings.size();
  judge_late_gyros(pass.settings, clocks, late_s, findings,
                   latest_s > kTooLate_s ? Finding::Severity::kDoNotUse : Finding::Severity::kWarning,
                   ", which is in the attitude");
  for (std::size_t i = before; corrected && i < findings.size(); ++i) {
    findings[i].cure = kCureAfterCorrection;
  }
  const double found_s = middle.is_sure(kSigmasToTell) ? middle.value : 0;
  if (do_no_two_agree(pass.settings, late_s, found_s)) {
    forbid_late_gyros(findings, before, found_s);
  }
}

}  // namespace trihedron::ground
