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

/// Of a drift coefficient or a component of an alignment.
double& value_in(Calibration& calibration, const ParameterId& state) {
  GyroCalibration& gyro = calibration.gyros.at(state.gyro());
  if (state.is_alignment()) {
    return gyro.alignment_rotation_vector_rad(static_cast<Index>(state.component));
  }
  const std::vector<DriftCoefficient> its = coefficients_of(gyro.drift_model);
  return gyro.drift_rad_s.at(static_cast<std::size_t>(std::ranges::find(its, state.coefficient) - its.begin()));
}

/// Values of states in the order of drift_and_alignment(), with the corrections of the alignments as rotations in c
/// after them: exp(correction) exp(alignment).
VectorXd corrected(const std::vector<ParameterId>& states, VectorXd values, const VectorXd& corrections) {
  for (Index i = 0; i < values.size(); ++i) {
    const ParameterId& state = states[static_cast<std::size_t>(i)];
    if (state.is_drift()) {
      values(i) += corrections(i);
    } else if (state.component == 0) {
      const auto C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(values.segment<3>(i)));
      values.segment<3>(i) = (Rot<C, C>::exp(Vec<C>::assume(corrections.segment<3>(i))) * C_c_b).log().raw();
    }
  }
  return values;
}

void correct(Calibration& calibration, const std::vector<ParameterId>& states, const VectorXd& corrections) {
  VectorXd values(std::ssize(states));
  std::ranges::transform(states, values.begin(),
                         [&](const ParameterId& state) { return value_of(calibration, state); });
  values = corrected(states, std::move(values), corrections);
  for (std::size_t i = 0; i < states.size(); ++i) {
    value_in(calibration, states[i]) = values(static_cast<Index>(i));
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

Calibration LeftOut::completed(Calibration by_kept, const Rot<In, C>& C_in_c) const {
  if (nothing()) {
    return by_kept;
  }
  Calibration completed = with_model(std::move(by_kept), all_.gyros.front().drift_model);
  const VectorXd corrections = -made_up_ * mean_;
  correct(completed, states_, corrections);
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i].is_alignment() && states_[i].component == 0) {
      Eigen::Vector3d& momentum_in = completed.gyros.at(states_[i].gyro()).momentum_in;
      momentum_in = rotated<double>(momentum_in, C_in_c.raw() * corrections.segment<3>(static_cast<Index>(i)));
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
  const VectorXd corrections = -made_up_ * mean_;
  const MatrixXd left_out = all_.covariance(left_out_, left_out_);
  VectorXd variance = VectorXd::Zero(std::ssize(all_.states));
  variance(kept_) = (made_up_ * left_out * made_up_.transpose()).diagonal();
  variance(left_out_) = left_out.diagonal();
  ParameterHistory completed{by_kept.t, {}, {}};
  for (std::size_t i = 0; i < by_kept.t.size(); ++i) {
    VectorXd value = VectorXd::Constant(variance.size(), std::nan(""));
    value(kept_) = corrected(states_, VectorXd::Map(by_kept.value[i].data(), std::ssize(states_)), corrections);
    completed.value.emplace_back(value.begin(), value.end());
    std::vector<double>& sigmas = completed.sigma.emplace_back(variance.size());
    std::ranges::transform(variance, sigmas.begin(), [](double its) { return std::sqrt(its); });
    for (std::size_t column = 0; column < kept_.size(); ++column) {
      double& sigma = sigmas[static_cast<std::size_t>(kept_[column])];
      sigma = std::hypot(sigma, by_kept.sigma[i][column]);
    }
  }
  return completed;
}

}  // namespace trihedron::ground
