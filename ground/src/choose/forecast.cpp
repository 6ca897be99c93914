#include "choose/forecast.hpp"

#include <algorithm>
#include <cmath>

#include "model/prior.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kParts = PassProblem::kParts;
/// Parts at the beginning that are only fitted, not forecast.
constexpr std::size_t kLearning = 2;

/// Information on the states of a smaller model: the states that it does not have are zero.
struct Restricted {
  double log_likelihood = 0;
  VectorXd x;  ///< truth − solution, of all states
};

/// By a triangle of all states. `kept`: of each state; `value`: of each state at the solution.
Restricted restricted(const MatrixXd& triangle, const std::vector<bool>& kept, const VectorXd& value) {
  const Index n = triangle.cols() - 1;
  const Index size = std::count(kept.begin(), kept.end(), true);
  MatrixXd rows(n + 1, size + 1);
  rows.col(size) = triangle.col(n);
  Index column = 0;
  for (Index i = 0; i < n; ++i) {
    if (kept[static_cast<std::size_t>(i)]) {
      rows.col(column++) = triangle.col(i);
    } else {
      rows.col(size) += value(i) * triangle.col(i);
    }
  }
  const MatrixXd own = triangle_of(rows);
  const VectorXd found =
      own.topLeftCorner(size, size).triangularView<Eigen::Upper>().solve(own.topRightCorner(size, 1));
  Restricted result;
  result.log_likelihood = -own.diagonal().head(size).array().abs().log().sum() - own(size, size) * own(size, size) / 2;
  result.x = -value;
  column = 0;
  for (Index i = 0; i < n; ++i) {
    if (kept[static_cast<std::size_t>(i)]) {
      result.x(i) = found(column++);
    }
  }
  return result;
}

Forecast forecast(const PassProblem& problem, const PassSolution& solution, const DriftModelId& model,
                  const std::vector<MatrixXd>& triangles, const std::vector<std::size_t>& ends) {
  const Layout& layout = problem.layout();
  const std::vector<DriftCoefficient> coefficients = coefficients_of(layout.drift_model);
  const std::vector<DriftCoefficient> smaller = coefficients_of(model);
  std::vector<bool> kept(static_cast<std::size_t>(layout.size()), true);
  VectorXd value = VectorXd::Zero(layout.size());
  for (int k = 0; k < layout.gyros; ++k) {
    for (int i = 0; i < layout.drift_size(); ++i) {
      const int state = layout.drift(k) + i;
      kept[static_cast<std::size_t>(state)] =
          std::ranges::find(smaller, coefficients[static_cast<std::size_t>(i)]) != smaller.end();
      value(state) = solution.gyros[k].drift_rad_s(i);
    }
  }
  CalibrationSetup its_setup = problem.setup().on_board;
  its_setup.layout = {.gyros = layout.gyros, .drift_model = model};
  Forecast result{model, 0, {}};
  for (std::size_t part = 0; part < ends.size(); ++part) {
    const Restricted known = restricted(triangles[part], kept, value);
    if (part + 1 == ends.size()) {
      result.log_likelihood += known.log_likelihood;
      break;
    }
    result.log_likelihood -= part == 0 ? known.log_likelihood : 0;
    Forecast::Fit& fit = result.fits.emplace_back();
    fit.until = problem.begin_of(ends[part] + 1);
    for (int k = 0; k < layout.gyros; ++k) {
      Gyro gyro = solution.gyros[k];
      add_parameter_errors(layout, k, known.x, gyro);
      Gyro own = gyro;
      own.drift_rad_s.resize(static_cast<Index>(smaller.size()));
      for (std::size_t i = 0; i < smaller.size(); ++i) {
        const auto found = std::ranges::find(coefficients, smaller[i]);
        own.drift_rad_s(static_cast<Index>(i)) = gyro.drift_rad_s(found - coefficients.begin());
      }
      fit.gyros.push_back(record_of(own, k, its_setup, 0));
    }
  }
  return result;
}

/// The gyros of the fit, with the momenta set by the smoothed attitude at one fix.
std::vector<GyroCalibration> records_of(const Forecast::Fit& fit, const SmoothedCourse& course, std::size_t at) {
  std::vector<GyroCalibration> records = fit.gyros;
  for (std::size_t k = 0; k < records.size(); ++k) {
    const auto C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(records[k].alignment_rotation_vector_rad));
    records[k].readout_bias.setZero();
    records[k].momentum_in =
        course.attitude.q_in_c[at] * (C_c_b.raw() * course.readings.direction(at, static_cast<int>(k)));
  }
  return records;
}

}  // namespace

std::vector<Forecast> forecasts(const PassProblem& problem, const BatchResult& found,
                                const std::vector<DriftModelId>& models) {
  if (problem.arcs() < kParts) {
    return {};
  }
  std::vector<std::size_t> ends;
  for (std::size_t part = kLearning; part <= kParts; ++part) {
    ends.push_back(problem.end_of(part) - 1);
  }
  const PassProblem::Linear& linear = found.linear;
  const std::vector<MatrixXd> triangles = triangles_after(linear.prior, linear.prior_y, linear.stages, ends);
  std::vector<Forecast> all;
  all.reserve(models.size());
  for (const DriftModelId& model : models) {
    all.push_back(forecast(problem, found.before, model, triangles, ends));
  }
  return all;
}

std::vector<DriftModelForecast> flown(const std::vector<Forecast>& forecasts, const SmoothedCourse& course) {
  Pass pass;
  pass.gyro = course.readings;
  const std::vector<Time>& times = course.attitude.t;
  std::vector<DriftModelForecast> all;
  for (const Forecast& forecast : forecasts) {
    double square = 0;
    double count = 0;
    for (std::size_t i = 0; i < forecast.fits.size(); ++i) {
      const Time end = i + 1 < forecast.fits.size() ? forecast.fits[i + 1].until : Time::max();
      const auto from = std::ranges::lower_bound(times, forecast.fits[i].until);
      const std::vector<Time> epochs(from, std::lower_bound(from, times.end(), end));
      if (epochs.empty()) {
        continue;
      }
      const auto at = static_cast<std::size_t>(from - times.begin());
      const AttitudeErrors errors =
          attitude_errors(fly_open_loop(pass, epochs.front(), records_of(forecast.fits[i], course, at), epochs), times,
                          course.attitude.q_in_c);
      for (const Eigen::Vector3d& error : errors.error_rad) {
        square += error.squaredNorm();
        ++count;
      }
    }
    all.push_back({forecast.drift_model, forecast.log_likelihood - forecasts.front().log_likelihood,
                   std::sqrt(square / std::max(count, 1.0))});
  }
  return all;
}

}  // namespace trihedron::ground
