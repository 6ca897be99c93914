#include "model/left_out.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trihedron/core/frames.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double& value_in(Calibration& calibration, const ParameterId& drift) {
  GyroCalibration& gyro = calibration.gyros.at(drift.gyro());
  const std::vector<DriftCoefficient> its = coefficients_of(gyro.drift_model);
  return gyro.drift_rad_s.at(static_cast<std::size_t>(std::ranges::find(its, drift.coefficient) - its.begin()));
}

/// Of each gyro, as rotation vector in c, rad: what corrections of coefficients and alignments say of the latter.
std::vector<Eigen::Vector3d> turns_of(const std::vector<ParameterId>& states, const VectorXd& corrections,
                                      std::size_t gyros) {
  std::vector<Eigen::Vector3d> turns(gyros, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].is_alignment()) {
      turns.at(states[i].gyro())(static_cast<Index>(states[i].component)) = corrections(static_cast<Index>(i));
    }
  }
  return turns;
}

void correct(Calibration& calibration, const std::vector<ParameterId>& states, const VectorXd& corrections) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].is_drift()) {
      value_in(calibration, states[i]) += corrections(static_cast<Index>(i));
    }
  }
  const std::vector<Eigen::Vector3d> turns = turns_of(states, corrections, calibration.gyros.size());
  for (std::size_t k = 0; k < turns.size(); ++k) {
    Eigen::Vector3d& alignment = calibration.gyros[k].alignment_rotation_vector_rad;
    const auto C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(alignment));
    alignment = (Rot<C, C>::exp(Vec<C>::assume(turns[k])) * C_c_b).log().raw();
  }
}

/// With another drift model, its coefficients those of the calibration, or zero.
Calibration with_model(Calibration calibration, const DriftModelId& model) {
  Calibration other = calibration;
  other.states = drift_and_alignment(model, calibration.gyros.size());
  for (GyroCalibration& gyro : other.gyros) {
    gyro.drift_model = model;
    gyro.drift_rad_s.assign(static_cast<std::size_t>(model.size()), 0);
  }
  for (const ParameterId& state : other.states) {
    if (state.is_drift() && std::ranges::find(calibration.states, state) != calibration.states.end()) {
      value_in(other, state) = value_in(calibration, state);
    }
  }
  return other;
}

/// Of the amplitudes of drift that comes back, with these columns of those about the other states.
MatrixXd with_columns(const MatrixXd& amplitudes, const std::vector<Index>& kept) {
  MatrixXd with(amplitudes.rows(), amplitudes.size() > 0 ? std::ssize(kept) + amplitudes.rows() : 0);
  if (amplitudes.size() > 0) {
    with << amplitudes(Eigen::all, kept), amplitudes.rightCols(amplitudes.rows());
  }
  return with;
}

}  // namespace

LeftOut::LeftOut(const Calibration& all, const DriftModelId& kept)
    : all_(all), kept_model_(kept), states_(drift_and_alignment(kept, all.gyros.size())) {
  for (const ParameterId& state : states_) {
    kept_.push_back(rows_of(all, {state}).front());
    if (kept_.back() == std::ssize(all.states)) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name_of(state)),
                       "use a calibration of these gyros, made with the same drift model");
    }
  }
  for (Index row = 0; row < std::ssize(all.states); ++row) {
    if (all.states[static_cast<std::size_t>(row)].is_drift() && std::ranges::find(kept_, row) == kept_.end()) {
      left_out_.push_back(row);
    }
  }
  if (nothing()) {
    return;
  }
  mean_.resize(std::ssize(left_out_));
  std::ranges::transform(left_out_, mean_.begin(),
                         [&](Index row) { return value_of(all, all.states[static_cast<std::size_t>(row)]); });
  // The regression of those kept on those left out, with the sign turned. In units of the sigmas, which differ by many
  // powers of ten.
  const VectorXd sigma = all.covariance.diagonal().cwiseSqrt().cwiseMax(std::numeric_limits<double>::min());
  const MatrixXd correlation = sigma.cwiseInverse().asDiagonal() * all.covariance * sigma.cwiseInverse().asDiagonal();
  const MatrixXd by_left_out =
      correlation(left_out_, left_out_).ldlt().solve(MatrixXd(correlation(left_out_, kept_))).transpose();
  made_up_ = -(sigma(kept_).asDiagonal() * by_left_out * sigma(left_out_).cwiseInverse().asDiagonal());
}

MatrixXd LeftOut::mean_squares() const { return all_.covariance(left_out_, left_out_) + mean_ * mean_.transpose(); }

Calibration LeftOut::reduced() const {
  Calibration reduced = with_model(all_, kept_model_);
  if (nothing()) {
    reduced.covariance = all_.covariance(kept_, kept_);
    reduced.amplitude_covariance = with_columns(all_.amplitude_covariance, kept_);
    return reduced;
  }
  correct(reduced, states_, made_up_ * mean_);
  MatrixXd map = MatrixXd::Identity(all_.covariance.rows(), all_.covariance.cols());
  map(kept_, left_out_) = made_up_;
  reduced.covariance = (map * all_.covariance * map.transpose())(kept_, kept_);
  MatrixXd amplitudes = all_.amplitude_covariance;
  if (amplitudes.size() > 0) {
    amplitudes.leftCols(map.cols()) *= map.transpose();
  }
  reduced.amplitude_covariance = with_columns(amplitudes, kept_);
  return reduced;
}

Calibration LeftOut::completed(Calibration by_kept, const std::optional<AttitudeSolution>& attitude) const {
  if (nothing()) {
    return by_kept;
  }
  Calibration completed = with_model(std::move(by_kept), all_.gyros.front().drift_model);
  const VectorXd corrections = -made_up_ * mean_;
  correct(completed, states_, corrections);
  if (attitude) {
    const std::vector<Eigen::Vector3d> turns = turns_of(states_, corrections, completed.gyros.size());
    for (std::size_t k = 0; k < turns.size(); ++k) {
      Eigen::Vector3d& momentum_in = completed.gyros[k].momentum_in;
      momentum_in = rotated<double>(momentum_in, attitude->C_in_c.raw() * turns[k]);
    }
  }
  for (std::size_t i = 0; i < left_out_.size(); ++i) {
    value_in(completed, all_.states[static_cast<std::size_t>(left_out_[i])]) = mean_(static_cast<Index>(i));
  }
  const MatrixXd left_out = all_.covariance(left_out_, left_out_);
  MatrixXd apart = MatrixXd::Zero(all_.covariance.rows(), all_.covariance.cols());
  apart(kept_, kept_) = completed.covariance;
  apart(left_out_, left_out_) = left_out;
  MatrixXd map = MatrixXd::Identity(apart.rows(), apart.cols());
  map(kept_, left_out_) = -made_up_;
  completed.covariance = map * apart * map.transpose();
  completed.covariance = (completed.covariance + completed.covariance.transpose()).eval() / 2;
  return completed;
}

Calibration LeftOut::completed_prior(Calibration kept) const {
  if (nothing()) {
    return kept;
  }
  Calibration completed = with_model(std::move(kept), all_.gyros.front().drift_model);
  MatrixXd covariance = MatrixXd::Zero(all_.covariance.rows(), all_.covariance.cols());
  covariance(kept_, kept_) = completed.covariance;
  covariance(left_out_, left_out_) = mean_squares().diagonal().asDiagonal();
  completed.covariance = covariance;
  return completed;
}

ParameterHistory LeftOut::completed(const ParameterHistory& by_kept) const {
  if (nothing()) {
    return by_kept;
  }
  const VectorXd less = made_up_ * mean_;
  const MatrixXd left_out = all_.covariance(left_out_, left_out_);
  VectorXd value = VectorXd::Zero(std::ssize(all_.states));
  VectorXd variance = value;
  value(kept_) = -less;
  variance(kept_) = (made_up_ * left_out * made_up_.transpose()).diagonal();
  value(left_out_).setConstant(std::nan(""));
  variance(left_out_) = left_out.diagonal();
  ParameterHistory completed{by_kept.t, {}, {}};
  for (std::size_t i = 0; i < by_kept.t.size(); ++i) {
    std::vector<double>& values = completed.value.emplace_back(value.begin(), value.end());
    std::vector<double>& sigmas = completed.sigma.emplace_back(variance.size());
    std::ranges::transform(variance, sigmas.begin(), [](double its) { return std::sqrt(its); });
    for (std::size_t column = 0; column < kept_.size(); ++column) {
      const auto row = static_cast<std::size_t>(kept_[column]);
      values[row] += by_kept.value[i][column];
      sigmas[row] = std::hypot(sigmas[row], by_kept.sigma[i][column]);
    }
  }
  return completed;
}

}  // namespace trihedron::ground
