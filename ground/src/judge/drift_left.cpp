#include "judge/drift_left.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "judge/angle_between_momenta.hpp"
#include "model/orbital_rate.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::ground {
namespace {

constexpr std::size_t kComponents = 2;  ///< of an innovation per gyro

/// Times and innovations, in their sigmas, of one gyro.
struct OfGyro {
  std::vector<double> t_s;
  std::vector<double> z[kComponents];
  double sigmas_rad[kComponents] = {};  ///< their sum
};

std::vector<OfGyro> by_gyro(const std::vector<FixRecord>& fixes) {
  std::vector<OfGyro> all;
  for (const FixRecord& fix : fixes) {
    if (fix.status != FixStatus::kUsed || fix.head != 0) {
      continue;
    }
    all.resize(std::max(all.size(), fix.innovation.size() / kComponents));
    for (std::size_t k = 0; k < fix.innovation.size() / kComponents; ++k) {
      const double* const y = &fix.innovation[k * kComponents];
      const double* const sigma = &fix.innovation_sigma[k * kComponents];
      if (sigma[0] > 0 && sigma[1] > 0) {
        all[k].t_s.push_back(to_seconds(fix.t - fixes.front().t));
        all[k].z[0].push_back(y[0] / sigma[0]);
        all[k].z[1].push_back(y[1] / sigma[1]);
        all[k].sigmas_rad[0] += sigma[0];
        all[k].sigmas_rad[1] += sigma[1];
      }
    }
  }
  return all;
}

/// Process noise that was found and is more than gyros have; empty where there is none.
std::string noise_that_stands_for_drift(const CalibrationRun& run) {
  // Over an orbit a random walk as large moves a momentum by 0.5 arcseconds, as the sigmas of a calibration are.
  constexpr double kUsualWalk_rad_sqrt_s = 3e-8;
  if (!run.options.find_noise) {
    return {};
  }
  if (std::ranges::any_of(run.evidence, [](const Evidence& its) {
        return its.state == FurtherState::kWanderingDrift && its.accepted;
      })) {
    const FurtherStateOptions& states = run.options.further_states;
    return fmt::format("drift of {:.1e} rad/s, 1-sigma, that wanders in {:.0f} min was needed beside the model",
                       states.wandering_drift_rad_s, to_seconds(states.wandering_time) / 60);
  }
  const double walk = run.options.direction_random_walk_rad_sqrt_s;
  return walk > kUsualWalk_rad_sqrt_s
             ? fmt::format("a random walk of the momenta of {:.1e} rad/s^0.5 was needed beside the model", walk)
             : std::string();
}

/// 1-sigma of how far this noise moves a momentum in a pass, per axis.
double moved_by_noise_rad(const CalibrationNoise& noise, double duration_s) {
  const double x = noise.wandering_time_s > 0 ? duration_s / noise.wandering_time_s : 0;
  // Variance of the integral of a Gauss-Markov process.
  const double wandering =
      std::sqrt(std::max(2 * (x - 1 + std::exp(-x)), 0.0)) * noise.wandering_drift_rad_s * noise.wandering_time_s;
  return std::hypot(wandering, noise.direction_random_walk_rad_sqrt_s * std::sqrt(duration_s));
}

/// Of all pairs of gyros: drift of one moves those that it has a part in.
std::vector<AngleBetweenMomenta> angles_between(const GyroTelemetry& telemetry,
                                                const std::vector<GyroCalibration>& gyros) {
  std::vector<AngleBetweenMomenta> angles;
  for (int second = 1; second < static_cast<int>(gyros.size()); ++second) {
    for (int first = 0; first < second; ++first) {
      if (auto angle = AngleBetweenMomenta::of(telemetry, gyros, first, second)) {
        angles.push_back(*std::move(angle));
      }
    }
  }
  return angles;
}

/// By the angle that speaks most for drift.
std::optional<AngleBetweenMomenta::Wander> wander_of(const std::vector<AngleBetweenMomenta>& angles,
                                                     const CalibrationNoise& noise) {
  std::optional<AngleBetweenMomenta::Wander> least;
  for (const AngleBetweenMomenta& angle : angles) {
    const AngleBetweenMomenta::Wander its = angle.wander(noise);
    least = !least || its.log_odds < least->log_odds ? its : *least;
  }
  return least;
}

/// In the smallest sigma of the last attitude; 0 where there is none.
double in_sigmas_of_attitude(const CalibrationRun& run, double moved_rad) {
  return run.attitude.sigma_rad.empty() ? 0 : moved_rad / run.attitude.sigma_rad.back().minCoeff();
}

}  // namespace

std::optional<SlowLine> strongest_slow_line(const std::vector<FixRecord>& fixes, double shortest_period_s) {
  constexpr std::size_t kFew = 200;  // of more the sums below are normal
  std::optional<SlowLine> strongest;
  double most = 0;
  double tried = 0;
  const std::vector<OfGyro> gyros = by_gyro(fixes);
  for (std::size_t k = 0; k < gyros.size(); ++k) {
    const OfGyro& its = gyros[k];
    const std::size_t n = its.t_s.size();
    if (n < kFew) {
      continue;
    }
    const double span_s = its.t_s.back() - its.t_s.front();
    const auto lines = static_cast<int>(span_s / shortest_period_s);
    std::vector<std::complex<double>> first(n);
    std::ranges::transform(its.t_s, first.begin(),
                           [span_s](double t_s) { return std::polar(1.0, -2 * std::numbers::pi * t_s / span_s); });
    std::vector<std::complex<double>> turn(n, 1.0);
    for (int line = 1; line <= lines; ++line) {
      check_stop();
      std::complex<double> sum[kComponents];
      for (std::size_t i = 0; i < n; ++i) {
        turn[i] *= first[i];
        sum[0] += its.z[0][i] * turn[i];
        sum[1] += its.z[1][i] * turn[i];
      }
      for (std::size_t component = 0; component < kComponents; ++component) {
        ++tried;
        // Exponentially distributed, of mean 1, where the innovations are white.
        const double power = std::norm(sum[component]) / static_cast<double>(n);
        if (power > most) {
          most = power;
          const double amplitude = 2 * std::abs(sum[component]) / static_cast<double>(n);
          strongest = {static_cast<int>(k), span_s / line, amplitude,
                       amplitude * its.sigmas_rad[component] / static_cast<double>(n), 0};
        }
      }
    }
  }
  if (strongest) {
    strongest->log_chance = std::min(0.0, std::log(tried) - most);
  }
  return strongest;
}

void judge_drift_left(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  // One pass in a hundred thousand that is as the model says.
  const double limit = std::log(1e-5);
  // Periods down to a tenth of an orbit: drift of low degree makes no shorter ones.
  constexpr double kMultiples = 10;
  constexpr double kUsualOrbit_s = 5400;
  // By so much likelier that the gyros are quiet than that they move as the noise says; and by so much less likely,
  // twenty to one, that it is drift.
  constexpr double kLogOdds = 10;
  constexpr double kLogOddsOfDrift = -3;
  // Of the attitude, by which an error of the star tracker would be off that the sigmas do not tell.
  constexpr double kMostSigmasOff = 3;

  const bool told = std::ranges::any_of(findings, [](const Finding& finding) {
    return finding.code == FindingCode::kInnovationsNotWhite || finding.code == FindingCode::kOrbitalLine;
  });
  const double rate_rad_s = std::abs(orbital_rate_rad_s(pass.star_tracker));
  const double orbit_s = rate_rad_s > 0 ? 2 * std::numbers::pi / rate_rad_s : kUsualOrbit_s;
  std::vector<std::string> drift;
  std::vector<std::string> star_tracker;
  std::string either;
  const std::optional<SlowLine> line = strongest_slow_line(run.fixes, orbit_s / kMultiples);
  const bool is_line = line && line->log_chance < limit && !told;
  const std::string noise = noise_that_stands_for_drift(run);
  std::vector<AngleBetweenMomenta> angles;
  if (is_line || !noise.empty()) {
    angles = angles_between(pass.gyro, run.calibration.gyros);
  }
  if (is_line) {
    // Drift moves all components about alike, and the angle as one of them.
    constexpr double kLessThanDrift = 0.5;
    const bool moves_angle = angles.empty() || std::ranges::any_of(angles, [&](const AngleBetweenMomenta& angle) {
                               return angle.largest_line_rad(line->period_s) > kLessThanDrift * line->amplitude_rad;
                             });
    (moves_angle ? drift : star_tracker)
        .push_back(fmt::format("the innovations of gyro {} have a line of {:.0f} min, amplitude {:.2f} sigma, {}; the "
                               "chance of one as strong is below 1e{:.0f}",
                               line->gyro + 1, line->period_s / 60, line->amplitude, angle_text(line->amplitude_rad),
                               std::ceil(line->log_chance / std::numbers::ln10)));
  }
  // Then what wanders is what is left of that drift.
  const bool has_orbital_period = run.orbital_error_over_drift &&
                                  !run.options.further_states.is_on(FurtherState::kOrbitalError) &&
                                  !run.options.further_states.is_on(FurtherState::kOrbitalDrift);
  if (has_orbital_period) {
    drift.push_back(fmt::format("drift at orbital period: ln of its odds against an error of the star tracker {:.1f}",
                                -*run.orbital_error_over_drift));
  }
  if (!noise.empty()) {
    const auto wander =
        !has_orbital_period && run.calibration.noise ? wander_of(angles, *run.calibration.noise) : std::nullopt;
    if (wander && wander->log_odds > kLogOdds) {
      star_tracker.push_back(
          noise + fmt::format("; it would move the angle by {}, root mean square", angle_text(wander->expected_rad)));
    } else {
      const double moved_rad =
          wander ? moved_by_noise_rad(*run.calibration.noise, to_seconds(pass.gyro.t.back() - pass.gyro.t.front())) : 0;
      if (wander && wander->log_odds > kLogOddsOfDrift && in_sigmas_of_attitude(run, moved_rad) > kMostSigmasOff) {
        either = fmt::format(
            "{}; ln of the odds for gyros that are quiet, by the angle between the momenta, {:.1f}; such noise moves a "
            "momentum by {} in this pass",
            noise, wander->log_odds, angle_text(moved_rad));
      } else {
        drift.push_back(noise);
      }
    }
  }
  if (!star_tracker.empty()) {
    double moved_rad = 0;
    for (const AngleBetweenMomenta& angle : angles) {
      moved_rad = std::max(moved_rad, angle.left_rad());
    }
    findings.push_back({FindingCode::kStarTrackerWanders,
                        "The star tracker has errors that come and go slowly: the angle between the momenta, which the "
                        "gyros read without it, does not move as drift would move it. Attitude and alignment follow "
                        "these errors, and their sigmas are wrong.",
                        fmt::format("{}; it moves by {}", fmt::join(star_tracker, "; "), angle_text(moved_rad)),
                        "Look for what the star tracker's errors follow: day and night, the place of the stars in its "
                        "field, heads that take turns, its clock; correct them before its fixes come here."});
  }
  if (!either.empty()) {
    findings.push_back({FindingCode::kDriftNotExplained,
                        "There is drift that wanders, or an error of the star tracker that comes and goes slowly: the "
                        "angle between the momenta, which the gyros read without it, does not tell which. Where it is "
                        "the star tracker, attitude and alignment follow it, and their sigmas are wrong.",
                        either,
                        "Calibrate on a longer pass, which tells them apart, or of other passes of this start-up. Look "
                        "for what the star tracker's errors may follow: warming up, day and night, the place of the "
                        "stars in its field, heads that take turns.",
                        Finding::Severity::kDoNotUse});
  }
  if (!drift.empty()) {
    findings.push_back({FindingCode::kDriftNotExplained,
                        "A part of the drift is in no coefficient of the model. The noise that stands for it is in the "
                        "sigmas of alignment and attitude; single coefficients may be off by many of theirs, as where "
                        "drift depends on place, history or temperature.",
                        fmt::format("{}", fmt::join(drift, "; ")),
                        "Do not carry single coefficients to another flight. Estimator batch with a larger drift model "
                        "may explain it; an error of the star tracker can look alike."});
  }
}

}  // namespace trihedron::ground
