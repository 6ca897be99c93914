#include "judge/changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

#include "trihedron/core/layout.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::ground {
namespace {

/// An explanation is named beside the likeliest where its ln of the odds is less by no more than this.
constexpr double kCannotBeTold = 5;
/// The error is up to so many times what a change is found to make, because the noise found and the drift model have
/// followed a part of it.
constexpr double kMoreThanFound = 2;
/// Where a change moves a parameter by so many claimed sigmas, the result is wrong.
constexpr double kSigmasOfWrong = 4 / kMoreThanFound;

std::string of_gyro(const Change& change) {
  return change.gyro < 0 ? std::string("all gyros") : fmt::format("gyro {}", change.gyro + 1);
}

std::string described(const Change& change) {
  switch (change.moving) {
    case Moving::kGyroCase:
      return fmt::format("{} of the case of {}",
                         change.motion == Motion::kStep      ? "a step"
                         : change.motion == Motion::kOrbital ? "a turn to and fro, at orbital rate,"
                         : change.motion == Motion::kDecay   ? "a turn that settles"
                                                             : "a slow turn",
                         of_gyro(change));
    case Moving::kStarTracker:
      return change.motion == Motion::kStep ? "a step of the star tracker's mounting"
             : change.motion == Motion::kFaster
                 ? "errors of the star tracker, or drift, at twice or three times the orbital rate"
             : change.motion == Motion::kDecay ? "a turn of the star tracker's mounting that settles"
                                               : "a slow turn of the star tracker's mounting";
    case Moving::kMomentum:
      return fmt::format("a jump of the momentum of {}", of_gyro(change));
    case Moving::kInertialAxes:
      return "a jump of the inertial axes of the star tracker";
    case Moving::kCoefficients:
      return fmt::format("{} of the coefficients of {}",
                         change.motion == Motion::kStep      ? "a jump"
                         : change.motion == Motion::kWalk    ? "a random walk"
                         : change.motion == Motion::kDecay   ? "a warm-up"
                         : change.motion == Motion::kOrbital ? "a change to and fro, at orbital rate,"
                                                             : "an even change",
                         of_gyro(change));
    case Moving::kAberration:
      return "aberration of starlight in the fixes";
    case Moving::kReadoutScale:
      return fmt::format("errors of scale, or of right angles, of the direction cosines of {}", of_gyro(change));
    case Moving::kReadoutField:
      return fmt::format("errors of the readings of {} that depend on the direction in the case", of_gyro(change));
  }
  return {};
}

FindingCode code_of(const Change& change) {
  switch (change.moving) {
    case Moving::kGyroCase:
      return FindingCode::kGyroMountingMoved;
    case Moving::kStarTracker:
      return change.motion == Motion::kFaster ? FindingCode::kStarTrackerWanders : FindingCode::kStarTrackerMoved;
    case Moving::kMomentum:
      return FindingCode::kMomentumJumped;
    case Moving::kInertialAxes:
      return FindingCode::kInertialAxesTurned;
    case Moving::kCoefficients:
      return FindingCode::kCoefficientsNotConstant;
    case Moving::kAberration:
      return FindingCode::kAberrationNotCorrected;
    case Moving::kReadoutScale:
      return FindingCode::kReadoutScaleOff;
    case Moving::kReadoutField:
      return FindingCode::kReadoutErrorByDirection;
  }
  return FindingCode::kOther;
}

std::string_view cure_of(const Change& change) {
  switch (change.moving) {
    case Moving::kGyroCase:
    case Moving::kStarTracker:
    case Moving::kMomentum:
    case Moving::kInertialAxes:
      return change.motion == Motion::kStep
                 ? "Cut the pass there and calibrate on the parts apart; look for what happened at that time."
             : change.motion == Motion::kFaster
                 ? "Correct the fixes by what the star tracker is known to be off, as its field of view or its "
                   "temperature makes it."
             : change.motion == Motion::kDecay ? "Let the mounting settle; calibrate on a later part of the pass."
                                               : "Look for what warms the mounting; calibrate on a shorter pass.";
    case Moving::kCoefficients:
      return change.motion == Motion::kStep ? "Cut the pass there and calibrate on the parts apart."
             : change.motion == Motion::kOrbital
                 ? "Look for what warms the gyros by day; keep their temperature, or take the sigmas as they are."
                 : "Use estimator batch with coefficient_change = \"on\" in "
                   "[further_states], or calibrate on a shorter "
                   "and later part of the pass.";
    case Moving::kAberration:
      return "Correct aberration in the star tracker, or in its fixes before they come here.";
    case Moving::kReadoutScale:
      return "Correct the scales of the direction cosines and the angles between their axes; check that each reading "
             "is a unit vector before it is scaled.";
    case Moving::kReadoutField:
      return "Correct the readings by a calibration of the readout over all directions.";
  }
  return {};
}

/// Coefficients in rad/s, pure numbers, or angles.
std::string size_text(const Change& change) {
  if (change.motion == Motion::kWalk) {
    return {};
  }
  if (change.moving == Moving::kReadoutField) {
    return fmt::format("{} in the mean of all directions, ", angle_text(change.size.value()));
  }
  const double size = change.size.norm();
  const double sigma = change.sigma.norm();
  const std::string text = change.moving == Moving::kCoefficients ? fmt::format("{:.1e} ± {:.1e} rad/s", size, sigma)
                           : change.moving == Moving::kAberration || change.moving == Moving::kReadoutScale
                               ? fmt::format("{:.1e} ± {:.1e}", size, sigma)
                               : fmt::format("{} ± {}", angle_text(size), angle_text(sigma));
  return text + ", ";
}

/// For a parameter of Calibration::states, where Change tells of it; nothing outside eq. (1).
std::optional<Eigen::Index> place_in_change(const ParameterId& state) {
  constexpr Eigen::Index kOwnParameters = Layout::kEq1 + 3;
  const Eigen::Index at = kOwnParameters * static_cast<Eigen::Index>(state.gyro());
  if (state.is_alignment()) {
    return at + Layout::kEq1 + state.component;
  }
  for (int member = 0; state.is_drift() && member < Layout::kEq1; ++member) {
    if (state.coefficient == DriftCoefficient::of_eq1(member)) {
      return at + member;
    }
  }
  return std::nullopt;
}

/// Of the parameters in the order of Calibration::states; 0 for those that Change does not tell of.
Eigen::VectorXd parameters_off(const Calibration& calibration, const Change& change) {
  Eigen::VectorXd off = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(calibration.states.size()));
  for (std::size_t row = 0; row < calibration.states.size(); ++row) {
    if (const auto place = place_in_change(calibration.states[row])) {
      off(static_cast<Eigen::Index>(row)) = change.parameters_off(*place);
    }
  }
  return off;
}

/// Of the parameters by which the result is off, the largest in its claimed sigma; of the alignments alone, or of all.
double sigmas_off(const Calibration& calibration, const Change& change, bool alignments_alone) {
  const Eigen::VectorXd off = parameters_off(calibration, change);
  double worst = 0;
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    if (!alignments_alone || calibration.states[static_cast<std::size_t>(i)].is_alignment()) {
      worst = std::max(worst, std::abs(off(i)) / std::sqrt(calibration.covariance(i, i)));
    }
  }
  return worst;
}

/// What moves the attitude by the fixes, in its claimed sigmas, the largest of its axes: the amplitude of rotations to
/// and fro of the star tracker or of a case, which are taken for the attitude; what the readings are off; how far the
/// star tracker or its inertial axes have moved, by which the attitude before differs from that after.
double sigmas_off_attitude(const CalibrationRun& run, const Change& change) {
  if (run.attitude.sigma_rad.empty()) {
    return 0;
  }
  const Eigen::Array3d sigma_rad = run.attitude.sigma_rad.back().array();
  const bool is_to_and_fro =
      change.motion == Motion::kFaster || (change.motion == Motion::kOrbital && change.moving == Moving::kGyroCase);
  if (is_to_and_fro) {
    const Eigen::Array3d sine = change.size.head<3>();
    const Eigen::Array3d cosine = change.size.tail<3>();
    return ((sine.square() + cosine.square()).sqrt() / sigma_rad).maxCoeff();
  }
  if (change.moving == Moving::kReadoutField) {
    return (change.size.value() / sigma_rad).maxCoeff();
  }
  if (change.moving == Moving::kStarTracker) {
    return (change.size.array() / sigma_rad).abs().maxCoeff();
  }
  if (change.moving == Moving::kInertialAxes) {
    const Eigen::Vector3d size_c = run.attitude.q_in_c.back().conjugate() * Eigen::Vector3d(change.size);
    return (size_c.array() / sigma_rad).abs().maxCoeff();
  }
  return 0;
}

/// The likeliest, where it counts as there.
const Change* change_found(const CalibrationRun& run) {
  return run.changes.empty() || !run.changes.front().is_found() ? nullptr : &run.changes.front();
}

/// What goes to and fro at the orbital rate acts as other constants would, and is known apart from them too badly.
bool has_part_in_covariance(const Change& change) { return change.motion != Motion::kOrbital; }

/// Mean square of what the parameters are off by the likeliest of all changes: by what is found of it and by what is
/// not known of that, times the probability that it is there.
std::optional<Eigen::MatrixXd> off_by_change(const CalibrationRun& run) {
  constexpr double kNegligible = 0.01;
  if (run.changes.empty() || !has_part_in_covariance(run.changes.front())) {
    return std::nullopt;
  }
  const Change& change = run.changes.front();
  const double probability = 1 / (1 + std::exp(-change.log_odds));
  if (probability < kNegligible) {
    return std::nullopt;
  }
  const std::vector<ParameterId>& states = run.calibration.states;
  const auto n = static_cast<Eigen::Index>(states.size());
  const Eigen::MatrixXd square =
      probability * (change.parameters_off * change.parameters_off.transpose() + change.parameters_off_covariance);
  Eigen::MatrixXd by_change = Eigen::MatrixXd::Zero(n, square.rows());
  for (Eigen::Index row = 0; row < n; ++row) {
    if (const auto place = place_in_change(states[static_cast<std::size_t>(row)])) {
      by_change(row, *place) = 1;
    }
  }
  return by_change * square * by_change.transpose();
}

}  // namespace

void put_changes_into_covariance(CalibrationRun& run) {
  if (const auto off = off_by_change(run)) {
    run.calibration.covariance += *off;
  }
}

void put_changes_into_errors(CalibrationRun& run) {
  const auto off = off_by_change(run);
  if (!off || !run.errors.is_known() || run.attitude.size() == 0) {
    return;
  }
  const Layout& layout = run.errors.layout;
  Eigen::MatrixXd by_parameters = Eigen::MatrixXd::Zero(run.errors.covariance.rows(), off->rows());
  by_parameters.middleRows(layout.drift(0), layout.parameters()).setIdentity();
  for (int k = 0; k < layout.gyros; ++k) {
    // Fixes give the attitude: where the alignment is off, so is the momentum.
    by_parameters.block<3, 3>(layout.direction(k), layout.alignment(k) - layout.drift(0)) =
        run.attitude.q_in_c.back().toRotationMatrix();
  }
  run.errors.covariance += by_parameters * *off * by_parameters.transpose();
}

void judge_changes(const CalibrationRun& run, std::vector<Finding>& findings) {
  const Change* const found = change_found(run);
  if (found == nullptr) {
    return;
  }
  const Change& likeliest = *found;
  std::string others;
  for (const Change& change : run.changes) {
    if (&change != &likeliest && change.log_odds > likeliest.log_odds - kCannotBeTold) {
      others += (others.empty() ? "; nearly as likely: " : ", ") + described(change);
    }
  }
  const double off_attitude = sigmas_off_attitude(run, likeliest);
  const double off = std::max(sigmas_off(run.calibration, likeliest, false), off_attitude);
  const bool of_coefficients = likeliest.moving == Moving::kCoefficients;
  const bool is_wrong = (of_coefficients ? sigmas_off(run.calibration, likeliest, true) : off) > kSigmasOfWrong;
  const auto minutes = [&](Time t) { return to_seconds(t - run.calibration.epoch) / 60; };
  std::string when;
  if (likeliest.motion == Motion::kStep) {
    constexpr Duration kToTheMinute = std::chrono::minutes(1);
    when = likeliest.until - likeliest.from < kToTheMinute
               ? fmt::format(" at {:.1f} min", minutes(likeliest.until))
               : fmt::format(" between {:.0f} and {:.0f} min", minutes(likeliest.from), minutes(likeliest.until));
  }
  std::string what = described(likeliest);
  what.front() = static_cast<char>(what.front() - 'a' + 'A');
  Finding finding{
      code_of(likeliest),
      fmt::format("{}{}: the estimates {}{}.", what, when,
                  likeliest.motion == Motion::kPresent ? "know nothing of it" : "take what moves for constant",
                  is_wrong                            ? ", and their sigmas are wrong"
                  : has_part_in_covariance(likeliest) ? "; what that makes of them is in their sigmas"
                                                      : ""),
      fmt::format("{}likelier than nothing by e^{:.0f}; the largest effect on {} is {:.1f} of its "
                  "sigmas{}",
                  size_text(likeliest), likeliest.log_odds,
                  off_attitude > 0 && off == off_attitude ? "the attitude" : "a parameter", off, others),
      std::string(cure_of(likeliest))};
  if (!is_wrong) {
    finding.severity = FindingSeverity::kWarning;
  }
  findings.push_back(std::move(finding));
}

}  // namespace trihedron::ground
