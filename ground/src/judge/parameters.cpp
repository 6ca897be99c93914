#include "judge/parameters.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include "judge/findings.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"
#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

/// Two nominal alignment accuracies of the system.
constexpr double kWeakAlignment_rad = 20 * kArcsecond;
/// Over this time a drift of a few degrees per day, of a gyro or of the orbit plane, is below the noise; over longer
/// times it can be mistaken for an alignment.
constexpr Duration kDriftStretch = std::chrono::minutes(10);

/// Root mean square over the sphere of the drift outside eq. (1) that a field was found to make, rad/s; gyro by gyro.
std::vector<double> rms_outside_eq1(const Calibration& calibration) {
  std::vector<double> square(calibration.gyros.size(), 0.0);
  for (const DriftFieldLevel& level : calibration.drift_field) {
    square[static_cast<std::size_t>(level.gyro)] += level.rms_rad_s * level.rms_rad_s;
  }
  std::ranges::transform(square, square.begin(), [](double its) { return std::sqrt(its); });
  return square;
}

/// Whether coefficients of eq. (1) and alignments are together where the prior lets them be. Fixes that contradict an
/// earlier calibration which was sure of itself were rejected, and the result stayed at it: what the pass says without
/// it is compared as well.
void judge_prior_as_a_whole(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSure = 1 - 1e-6;
  std::vector<ParameterId> states;
  std::ranges::copy_if(run.calibration.states, std::back_inserter(states), [](const ParameterId& state) {
    return state.is_alignment() || (state.is_drift() && state.coefficient.is_in_eq1());
  });
  const auto rows = rows_of(run.calibration, states);  // the prior has the same
  const Eigen::MatrixXd prior = run.known_before.covariance(rows, rows);
  Agreement agrees = agreement_with_prior(difference(run.known_before, run.calibration, states), prior,
                                          run.calibration.covariance(rows, rows), kSure);
  const bool is_between = !agrees.holds();
  if (!is_between && run.by_pass_alone) {
    const auto its_rows = rows_of(*run.by_pass_alone, states);
    agrees = agreement(difference(run.known_before, *run.by_pass_alone, states),
                       prior + run.by_pass_alone->covariance(its_rows, its_rows), kSure);
  }
  if (agrees.holds()) {
    return;
  }
  const bool of_file = pass.settings.prior.has_value();
  add(findings, FindingCode::kPriorContradicted,
      of_file
          ? fmt::format("The pass contradicts the earlier calibration that it was given as prior: coefficients or "
                        "alignments are others by now, and the result {}.",
                        is_between ? "lies between both" : "stayed at it, since fixes that contradict it were rejected")
          : "Coefficients and alignments together are found outside what the settings say of them before the pass, "
            "and the result is off with it.",
      fmt::format("chi-square {:.2g} of {} degrees of freedom; all but one in a million lie below {:.3g}",
                  agrees.chi_square, agrees.degrees_of_freedom, agrees.limit),
      of_file ? "Calibrate without the prior: coefficients change at every start of a rotor. Where both are of one "
                "start-up, calibrate both passes together, which tells what has moved."
              : "Give larger prior sigmas in pass.toml, and check the means and their units.");
}

/// An earlier calibration is judged as a whole. Parameters that a prior holds too tightly pull others away with them,
/// or leave what they should be to drift outside eq. (1), which is a small part of it where priors are right.
void judge_prior_sigmas(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSigmas = 5;
  constexpr double kSigmasOfField = 3;
  if (pass.settings.prior) {
    return;
  }
  std::string names;
  const auto name = [&](const std::string& what, double sigmas) {
    names += fmt::format("{}{} by {:.0f}", names.empty() ? "" : ", ", what, sigmas);
  };
  std::vector<double> largest_sigma(run.calibration.gyros.size(), 0.0);  // of coefficients of eq. (1)
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    const ParameterId& state = run.calibration.states[i];
    const bool is_coefficient = state.is_drift() && state.coefficient.is_in_eq1();
    if (!state.is_alignment() && !is_coefficient) {
      continue;
    }
    const double sigma = std::sqrt(run.known_before.covariance.diagonal()(static_cast<Eigen::Index>(i)));
    if (is_coefficient) {
      largest_sigma[state.gyro()] = std::max(largest_sigma[state.gyro()], sigma);
    }
    const double off = std::abs(value_of(run.calibration, state) - value_of(run.known_before, state));
    // Where the data tell little, what makes up for drift outside eq. (1) may leave it less known than before.
    if (off > kSigmas * std::hypot(sigma, sigma_of(run.calibration, state))) {
      name(name_of(state), off / sigma);
    }
  }
  const std::vector<double> outside = rms_outside_eq1(run.calibration);
  for (std::size_t k = 0; k < outside.size(); ++k) {
    if (largest_sigma[k] > 0 && outside[k] > kSigmasOfField * largest_sigma[k]) {
      name(fmt::format("drift of gyro {} outside eq. (1), against that of a coefficient of eq. (1),", k + 1),
           outside[k] / largest_sigma[k]);
    }
  }
  if (!names.empty()) {
    add(findings, FindingCode::kPriorContradicted,
        "Parameters are found outside what the settings say of them before the pass: they are held too tightly, and "
        "others are off with them.",
        "in prior sigmas: " + names, "Give larger prior sigmas in pass.toml, and check their units.");
  }
}

}  // namespace

void judge_halves(const CalibrationRun& run, std::vector<Finding>& findings) {
  const Statistics& statistics = run.calibration.statistics;
  const double square = statistics.halves_chi_square.value_or(0);
  const int freedom = statistics.halves_degrees_of_freedom.value_or(0);
  if (!is_chance(square, freedom)) {
    add(findings, FindingCode::kHalvesDisagree,
        "The first half of the pass gives other parameters than the whole: they moved, or the model is incomplete.",
        fmt::format("chi-square {:.0f} of {} degrees of freedom", square, freedom),
        "Let the coefficients change (coefficient_change = \"on\" in [further_states]), give more process noise, or "
        "calibrate a shorter pass.");
    // Of coefficients that are found to change it is no other evidence: what that makes of them is in their sigmas, or
    // their course is followed, of which half a pass may not show much.
    const bool is_followed = run.options.further_states.change_course != CourseOfChange::Kind::kEven;
    const bool is_told = std::ranges::any_of(findings, [&](const Finding& finding) {
      return (finding.code == FindingCode::kCoefficientsNotConstant && finding.severity != Severity::kDoNotUse) ||
             (finding.code == FindingCode::kCoefficientsChanged && is_followed);
    });
    if (is_told) {
      findings.back().severity = Severity::kWarning;
    }
  }
}

void judge_determination(const CalibrationRun& run, std::vector<Finding>& findings) {
  std::string names;
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    // Members outside eq. (1) are estimated to protect the others; they need not be determined themselves.
    const ParameterId& state = run.calibration.states[i];
    const bool outside = state.is_drift() && !state.coefficient.is_in_eq1();
    if (!outside && !is_determined(run, i)) {
      names += (names.empty() ? "" : ", ") + name_of(state);
    }
  }
  if (!names.empty()) {
    add(findings, FindingCode::kNotDetermined,
        "The data do not determine " + names + "; they are hardly better known than before.",
        "posterior sigma above half of the prior sigma", "Calibrate on a longer pass, with slews.");
  }
}

void judge_priors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const std::size_t before = findings.size();
  judge_prior_sigmas(pass, run, findings);
  if (findings.size() == before) {
    judge_prior_as_a_whole(pass, run, findings);
  }
}

void judge_steadiness(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  // Outliers are left out: they would seem to move a steady axis.
  const StarTrackerTelemetry used = used_fixes(pass, run.fixes);
  const Eigen::Vector3d& noise = pass.settings.star_tracker_noise_rad;
  const auto observability = alignment_observability(used, noise, noise.minCoeff());
  if (observability.sigma_rad <= kWeakAlignment_rad) {
    return;
  }
  const Eigen::Vector3d& axis = observability.weakest_axis_c;
  const bool is_about_all = observability.best_sigma_rad > kWeakAlignment_rad;
  const std::string what =
      is_about_all
          ? "The attitude hardly changes in space: the alignment of each gyro about any axis cannot be separated from "
            "its initial direction."
          : fmt::format(
                "Steady flight: the axis ({:+.3f}, {:+.3f}, {:+.3f}) in c is fixed in the body and in space "
                "(the orbit normal, where the spacecraft faces the Earth), so the alignment of each gyro about "
                "it cannot be separated from its initial direction.",
                axis.x(), axis.y(), axis.z());
  const bool believes = run.options.estimator == Estimator::kPaper;
  add(findings, FindingCode::kWeakAlignmentAxis,
      fmt::format("{} {} The attitude does not suffer from that while the flight stays steady.", what,
                  believes ? "Estimator paper takes noise for information there: its sigmas of that are too small."
                           : "The sigmas say so."),
      std::isfinite(observability.sigma_rad)
          ? fmt::format("about {} at best about {} from the fixes alone", angle_text(observability.sigma_rad),
                        is_about_all ? "the axis that moved least" : "this axis")
          : "the fixes alone do not determine it",
      fmt::format("Fly slews about {} axes during the calibration: ten minutes of 10° and more suffice.",
                  is_about_all ? "two" : "the other"));
  // What is not known is in the sigmas, and by them the forecast for flight as in the pass is made.
  const std::optional<OpenLoopForecast>& forecast = run.calibration.forecast;
  if (!believes && forecast && forecast->need && forecast->need->met) {
    Finding& finding = findings.back();
    finding.severity = Severity::kWarning;
    finding.text += " The need that is stated is met with these sigmas.";
  }
}

AlignmentObservability alignment_observability(const StarTrackerTelemetry& tracker,
                                               const Eigen::Vector3d& tracker_noise_rad, double fix_noise_rad) {
  // With a free direction φ in each stretch, fixes y = φ − C δ leave Σ (C − mean C)ᵀ (C − mean C) of information on δ.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double count = 0;
  double total = 0;
  const auto close_stretch = [&] {
    if (count > 0) {
      information += count * Eigen::Matrix3d::Identity() - sum.transpose() * sum / count;
    }
    total += count;
    sum.setZero();
    count = 0;
  };
  for (std::size_t i = 0; i < tracker.size(); ++i) {
    if (i > 0 &&
        (tracker.t[i] - tracker.t.front()) / kDriftStretch != (tracker.t[i - 1] - tracker.t.front()) / kDriftStretch) {
      close_stretch();
    }
    if (nearly_unit(tracker.q_in_c[i].norm())) {
      sum += tracker.q_in_c[i].normalized().toRotationMatrix();
      ++count;
    }
  }
  close_stretch();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  AlignmentObservability result;
  // The tracker's own noise makes a steady axis seem to move.
  const auto sigma_about = [&](int axis) {
    const Eigen::Array3d axis_c = solver.eigenvectors().col(axis);
    const double noise = total * (tracker_noise_rad.cwiseAbs2().array() * (1 - axis_c.square())).sum();
    return fix_noise_rad / std::sqrt(std::max(solver.eigenvalues()(axis) - noise, 0.0));
  };
  result.weakest_axis_c = solver.eigenvectors().col(0);
  result.sigma_rad = sigma_about(0);
  result.best_sigma_rad = sigma_about(2);
  return result;
}

}  // namespace trihedron::ground
