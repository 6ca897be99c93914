#include "model/prior.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>

#include "trihedron/core/precession.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

/// Means, and sigmas of κ and δ.
std::pair<GyroParameters, Eigen::VectorXd> prior_of_gyro(const GyroPrior& prior, int number,
                                                         const DriftFamily& family) {
  const std::vector<DriftCoefficient>& coefficients = family.coefficients();
  for (const auto* table : {&prior.drift_rad_s, &prior.drift_sigma_rad_s}) {
    for (const auto& [coefficient, value] : *table) {
      if (std::ranges::find(coefficients, coefficient) == coefficients.end()) {
        throw SetupError(fmt::format("the prior of gyro {} names drift coefficient '{}'", number, name_of(coefficient)),
                         fmt::format("the drift model has {}", fmt::join(coefficient_names(family.model()), ", ")));
      }
    }
  }
  const auto value_or = [](const std::map<DriftCoefficient, double>& table, const DriftCoefficient& coefficient,
                           double otherwise) {
    const auto found = table.find(coefficient);
    return found == table.end() ? otherwise : found->second;
  };
  GyroParameters mean;
  mean.drift_rad_s.resize(family.size());
  Eigen::VectorXd sigma(family.size() + 3);
  for (int i = 0; i < family.size(); ++i) {
    const DriftCoefficient& coefficient = coefficients[static_cast<std::size_t>(i)];
    mean.drift_rad_s(i) = value_or(prior.drift_rad_s, coefficient, 0);
    sigma(i) = value_or(prior.drift_sigma_rad_s, coefficient, family.prior_factor(i) * prior.drift_common_sigma_rad_s);
  }
  mean.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(prior.alignment_rotation_vector_rad)).raw();
  sigma.tail<3>() = prior.alignment_sigma_rad;
  return {mean, sigma};
}

ParameterPrior prior_of_calibration(const Calibration& earlier, int gyros, const DriftFamily& family) {
  ParameterPrior prior;
  std::vector<Eigen::Index> rows;
  for (const ParameterId& state : drift_and_alignment(family.model(), static_cast<std::size_t>(gyros))) {
    const auto found = std::ranges::find(earlier.states, state);
    if (found == earlier.states.end()) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name_of(state)),
                       "use a calibration of these gyros, made with the same drift model");
    }
    rows.push_back(found - earlier.states.begin());
  }
  prior.covariance = earlier.covariance(rows, rows);
  for (int k = 0; k < gyros; ++k) {
    prior.gyros.push_back(parameters_of(earlier.gyros[static_cast<std::size_t>(k)], family));
  }
  return prior;
}

}  // namespace

DriftFamily family_of(const DriftModelId& drift_model) {
  if (is_for_whole_pass(drift_model) && (drift_model.degree < 1 || drift_model.degree > DriftFamily::kMaxDegree)) {
    throw SetupError(fmt::format("there is no drift model '{}'", name_of(drift_model)),
                     fmt::format("use {}, {}", kAutoDriftModel, drift_model_choices()));
  }
  return DriftFamily(drift_model);
}

DriftFamily family_of(const GyroCalibration& gyro) {
  const DriftFamily family = family_of(gyro.drift_model);
  if (gyro.drift_rad_s.size() != family.coefficients().size()) {
    throw SetupError(fmt::format("a gyro's coefficients are not those of drift model {}", name_of(gyro.drift_model)),
                     fmt::format("give {}", fmt::join(coefficient_names(gyro.drift_model), ", ")));
  }
  return family;
}

Eigen::Vector3d seen_in_c(const GyroParameters& gyro, const Eigen::Vector3d& h_b) {
  return gyro.C_c_b * without_bias<double>(h_b, gyro.readout_bias);
}

GyroParameters parameters_of(const GyroCalibration& gyro, const DriftFamily& family) {
  GyroParameters parameters;
  parameters.drift_rad_s.setZero(family.size());
  const std::vector<DriftCoefficient> own = coefficients_of(gyro.drift_model);
  for (int i = 0; i < family.size(); ++i) {
    const auto found = std::ranges::find(own, family.coefficients()[static_cast<std::size_t>(i)]);
    const auto index = static_cast<std::size_t>(found - own.begin());
    parameters.drift_rad_s(i) = index < gyro.drift_rad_s.size() ? gyro.drift_rad_s[index] : 0;
  }
  parameters.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
  parameters.readout_bias = gyro.readout_bias;
  return parameters;
}

GyroCalibration record_of(const GyroParameters& parameters, const DriftFamily& family) {
  GyroCalibration record;
  record.drift_model = family.model();
  record.drift_rad_s.assign(parameters.drift_rad_s.begin(), parameters.drift_rad_s.end());
  record.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(parameters.C_c_b).log().raw();
  record.readout_bias = parameters.readout_bias;
  return record;
}

ParameterPrior prior_of(const PassSettings& settings, int gyros, const DriftFamily& family) {
  if (settings.prior) {
    return prior_of_calibration(*settings.prior, gyros, family);
  }
  ParameterPrior prior;
  Eigen::VectorXd sigma(gyros * (family.size() + 3));
  for (int k = 0; k < gyros; ++k) {
    const auto [mean, its_sigma] = prior_of_gyro(settings.gyros[static_cast<std::size_t>(k)], k + 1, family);
    prior.gyros.push_back(mean);
    sigma.segment(k * its_sigma.size(), its_sigma.size()) = its_sigma;
  }
  prior.covariance = sigma.cwiseAbs2().asDiagonal();
  return prior;
}

}  // namespace trihedron::ground
