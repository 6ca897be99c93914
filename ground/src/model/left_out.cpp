#include "model/left_out.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

LeftOut::LeftOut(const Calibration& all, const DriftModelId& kept) : all_(all), kept_model_(kept) {
  for (const ParameterId& state : drift_and_alignment(kept, all.gyros.size())) {
    rows_.push_back(rows_of(all, {state}).front());
    if (rows_.back() == std::ssize(all.states)) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name_of(state)),
                       "use a calibration of these gyros, made with the same drift model");
    }
    (state.is_drift() ? kept_ : alignments_).push_back(rows_.back());
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
  // The regression of those kept on those left out, the alignments being the same, with the sign turned. In units of
  // the sigmas, which differ by many powers of ten.
  std::vector<Index> given = left_out_;
  given.insert(given.end(), alignments_.begin(), alignments_.end());
  const VectorXd sigma = all.covariance.diagonal().cwiseSqrt().cwiseMax(std::numeric_limits<double>::min());
  const MatrixXd correlation = sigma.cwiseInverse().asDiagonal() * all.covariance * sigma.cwiseInverse().asDiagonal();
  const MatrixXd by_given = correlation(given, given).ldlt().solve(MatrixXd(correlation(given, kept_))).transpose();
  made_up_ = -(sigma(kept_).asDiagonal() * by_given.leftCols(std::ssize(left_out_)) *
               sigma(left_out_).cwiseInverse().asDiagonal());
}

MatrixXd LeftOut::mean_squares() const { return all_.covariance(left_out_, left_out_) + mean_ * mean_.transpose(); }

Calibration LeftOut::reduced() const {
  Calibration reduced = with_model(all_, kept_model_);
  if (nothing()) {
    reduced.covariance = all_.covariance(rows_, rows_);
    reduced.amplitude_covariance = with_columns(all_.amplitude_covariance, rows_);
    return reduced;
  }
  const VectorXd more = made_up_ * mean_;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    value_in(reduced, all_.states[static_cast<std::size_t>(kept_[i])]) += more(static_cast<Index>(i));
  }
  MatrixXd map = MatrixXd::Identity(all_.covariance.rows(), all_.covariance.cols());
  map(kept_, left_out_) = made_up_;
  reduced.covariance = (map * all_.covariance * map.transpose())(rows_, rows_);
  MatrixXd amplitudes = all_.amplitude_covariance;
  if (amplitudes.size() > 0) {
    amplitudes.leftCols(map.cols()) *= map.transpose();
  }
  reduced.amplitude_covariance = with_columns(amplitudes, rows_);
  return reduced;
}

Calibration LeftOut::completed(Calibration by_kept) const {
  if (nothing()) {
    return by_kept;
  }
  Calibration completed = with_model(std::move(by_kept), all_.gyros.front().drift_model);
  const VectorXd less = made_up_ * mean_;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    value_in(completed, all_.states[static_cast<std::size_t>(kept_[i])]) -= less(static_cast<Index>(i));
  }
  for (std::size_t i = 0; i < left_out_.size(); ++i) {
    value_in(completed, all_.states[static_cast<std::size_t>(left_out_[i])]) = mean_(static_cast<Index>(i));
  }
  const MatrixXd left_out = all_.covariance(left_out_, left_out_);
  MatrixXd apart = MatrixXd::Zero(all_.covariance.rows(), all_.covariance.cols());
  apart(rows_, rows_) = completed.covariance;
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
  covariance(rows_, rows_) = completed.covariance;
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
    for (std::size_t column = 0; column < rows_.size(); ++column) {
      const auto row = static_cast<std::size_t>(rows_[column]);
      values[row] += by_kept.value[i][column];
      sigmas[row] = std::hypot(sigmas[row], by_kept.sigma[i][column]);
    }
  }
  return completed;
}

}  // namespace trihedron::ground
