#include "model/prior.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/drift_models.hpp"

namespace trihedron::ground {
namespace {

/// Prior sigma of a coefficient over that of the coefficients of eq. (1): further members are taken to be smaller, and
/// from degree 2 on the smaller the faster they change with h, so that each moves the momentum by as much. In esg20 all
/// are equal (docs/mathematics.md, section 3).
double prior_factor(const DriftModelId& model, const DriftCoefficient& coefficient) {
  constexpr double kOutsideEq1 = 0.05;
  if (coefficient.is_in_eq1()) {
    return 1;
  }
  const int degree = model == kEsg20 ? 2 : std::max<int>(coefficient.degree, 2);
  return kOutsideEq1 * std::sqrt(6.0 / (degree * (degree + 1)));
}

/// Writes the means, and the sigmas of κ and δ.
void put_prior(const GyroPrior& prior, int number, const Layout& layout, Gyro& mean,
               Eigen::Ref<Eigen::VectorXd> sigma) {
  const std::vector<DriftCoefficient> coefficients = coefficients_of(layout.drift_model);
  for (const auto* table : {&prior.drift_rad_s, &prior.drift_sigma_rad_s}) {
    for (const auto& [coefficient, value] : *table) {
      if (std::ranges::find(coefficients, coefficient) == coefficients.end()) {
        throw SetupError(fmt::format("the prior of gyro {} names drift coefficient '{}'", number, name_of(coefficient)),
                         fmt::format("the drift model has {}", fmt::join(coefficient_names(layout.drift_model), ", ")));
      }
    }
  }
  const auto value_or = [](const std::map<DriftCoefficient, double>& table, const DriftCoefficient& coefficient,
                           double otherwise) {
    const auto found = table.find(coefficient);
    return found == table.end() ? otherwise : found->second;
  };
  mean.drift_rad_s.setZero(layout.drift_columns());
  for (int i = 0; i < layout.drift_size(); ++i) {
    const DriftCoefficient& coefficient = coefficients[static_cast<std::size_t>(i)];
    mean.drift_rad_s(i) = value_or(prior.drift_rad_s, coefficient, 0);
    sigma(i) = value_or(prior.drift_sigma_rad_s, coefficient,
                        prior_factor(layout.drift_model, coefficient) * prior.drift_common_sigma_rad_s);
  }
  mean.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(prior.alignment_rotation_vector_rad)).raw();
  sigma.tail<3>() = prior.alignment_sigma_rad;
}

/// The states of a calibration, by number.
struct Parts {
  std::vector<Eigen::Index> rows;  ///< of coefficients that a model keeps and alignments, in the order of the layout
  std::vector<Eigen::Index> kept;  ///< coefficients alone
  std::vector<Eigen::Index> left_out;
  std::vector<Eigen::Index> alignments;
};

Parts parts_of(const Calibration& calibration, const DriftModelId& model) {
  Parts parts;
  for (const ParameterId& state : drift_and_alignment(model, calibration.gyros.size())) {
    const auto found = std::ranges::find(calibration.states, state);
    if (found == calibration.states.end()) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name_of(state)),
                       "use a calibration of these gyros, made with the same drift model");
    }
    parts.rows.push_back(found - calibration.states.begin());
    (state.is_drift() ? parts.kept : parts.alignments).push_back(parts.rows.back());
  }
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (calibration.states[i].is_drift() && std::ranges::find(parts.kept, row) == parts.kept.end()) {
      parts.left_out.push_back(row);
    }
  }
  return parts;
}

/// By how much the coefficients that a model keeps go with those that it leaves out, the alignments being the same:
/// along the pass that all were found by they make up for each other. Rows: kept; columns: left out.
Eigen::MatrixXd kept_by_left_out(const Calibration& calibration, const Parts& parts) {
  std::vector<Eigen::Index> given = parts.left_out;
  given.insert(given.end(), parts.alignments.begin(), parts.alignments.end());
  // In units of the sigmas, which differ by many powers of ten.
  const Eigen::VectorXd sigma =
      calibration.covariance.diagonal().cwiseSqrt().cwiseMax(std::numeric_limits<double>::min());
  const Eigen::MatrixXd correlation =
      sigma.cwiseInverse().asDiagonal() * calibration.covariance * sigma.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd by_given =
      correlation(given, given).ldlt().solve(Eigen::MatrixXd(correlation(given, parts.kept))).transpose();
  return sigma(parts.kept).asDiagonal() * by_given.leftCols(static_cast<Eigen::Index>(parts.left_out.size())) *
         sigma(parts.left_out).cwiseInverse().asDiagonal();
}

Eigen::VectorXd values_of(const Calibration& calibration, const std::vector<Eigen::Index>& states) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(states.size()));
  std::ranges::transform(states, values.begin(), [&](Eigen::Index state) {
    return value_of(calibration, calibration.states[static_cast<std::size_t>(state)]);
  });
  return values;
}

Prior prior_of_calibration(const Calibration& earlier, const Layout& layout) {
  const Parts parts = parts_of(earlier, layout.drift_model);
  Prior prior;
  for (int k = 0; k < layout.gyros; ++k) {
    prior.gyros[k] = gyro_of(earlier.gyros[static_cast<std::size_t>(k)], layout);
  }
  if (parts.left_out.empty()) {
    prior.covariance = earlier.covariance(parts.rows, parts.rows);
    return prior;
  }
  const Eigen::MatrixXd by_left_out = kept_by_left_out(earlier, parts);
  const Eigen::VectorXd made_up_for = by_left_out * values_of(earlier, parts.left_out);
  const int size = layout.drift_size();
  for (int k = 0; k < layout.gyros; ++k) {
    prior.gyros[k].drift_rad_s.head(size) -= made_up_for.segment(static_cast<Eigen::Index>(k) * size, size);
  }
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(earlier.covariance.rows(), earlier.covariance.cols());
  map(parts.kept, parts.left_out) = -by_left_out;
  prior.covariance = (map * earlier.covariance * map.transpose())(parts.rows, parts.rows);
  return prior;
}

}  // namespace

void refuse_unknown(const DriftModelId& drift_model) {
  const bool has_degree = drift_model.family == DriftModelId::Family::kVsh;
  if (has_degree && (drift_model.degree < 1 || drift_model.degree > DriftModelId::kMaxDegree)) {
    throw SetupError(fmt::format("there is no drift model '{}'", name_of(drift_model)),
                     fmt::format("use {}, {}", kAutoDriftModel, drift_model_choices()));
  }
}

void refuse_incomplete(const GyroCalibration& gyro) {
  refuse_unknown(gyro.drift_model);
  if (gyro.drift_rad_s.size() != static_cast<std::size_t>(gyro.drift_model.size())) {
    throw SetupError(fmt::format("a gyro's coefficients are not those of drift model {}", name_of(gyro.drift_model)),
                     fmt::format("give {}", fmt::join(coefficient_names(gyro.drift_model), ", ")));
  }
}

Gyro gyro_of(const GyroCalibration& record, const Layout& layout) {
  Gyro gyro;
  gyro.drift_rad_s.setZero(layout.drift_columns());
  const std::vector<DriftCoefficient> own = coefficients_of(record.drift_model);
  const std::vector<DriftCoefficient> wanted = coefficients_of(layout.drift_model);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto index = static_cast<std::size_t>(std::ranges::find(own, wanted[i]) - own.begin());
    gyro.drift_rad_s(static_cast<Eigen::Index>(i)) = index < record.drift_rad_s.size() ? record.drift_rad_s[index] : 0;
  }
  gyro.h_in = record.momentum_in;
  gyro.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(record.alignment_rotation_vector_rad)).raw();
  gyro.readout_bias = record.readout_bias;
  return gyro;
}

GyroCalibration record_of(const Gyro& gyro, const Layout& layout, double part_of_change) {
  GyroCalibration record;
  record.drift_model = layout.drift_model;
  Eigen::VectorXd drift = gyro.drift_rad_s.head(layout.drift_size());
  if (layout.further.coefficient_change) {
    drift.head<Layout::kEq1>() += part_of_change * gyro.drift_rad_s.segment<Layout::kEq1>(layout.change_column());
  }
  record.drift_rad_s.assign(drift.begin(), drift.end());
  record.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(gyro.C_c_b).log().raw();
  record.readout_bias = gyro.readout_bias;
  record.momentum_in = gyro.h_in;
  return record;
}

Prior prior_of(const PassSettings& settings, const Layout& layout) {
  if (settings.prior) {
    return prior_of_calibration(*settings.prior, layout);
  }
  Prior prior;
  Eigen::VectorXd sigma(layout.parameters());
  const int own = layout.drift_size() + 3;
  for (int k = 0; k < layout.gyros; ++k) {
    put_prior(settings.gyros[static_cast<std::size_t>(k)], k + 1, layout, prior.gyros[k],
              sigma.segment(static_cast<Eigen::Index>(k) * own, own));
  }
  prior.covariance = sigma.cwiseAbs2().asDiagonal();
  return prior;
}

}  // namespace trihedron::ground
