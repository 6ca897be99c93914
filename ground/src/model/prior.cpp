#include "model/prior.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>

#include "trihedron/core/precession.hpp"
#include "trihedron/ground/model/names.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

/// Means, and sigmas of κ and δ.
std::pair<GyroParameters, Eigen::VectorXd> prior_of_gyro(const GyroPrior& prior, int number,
                                                         const DriftFamily& family) {
  const std::vector<std::string>& names = family.names();
  for (const auto* table : {&prior.drift_rad_s, &prior.drift_sigma_rad_s}) {
    for (const auto& [name, value] : *table) {
      if (std::ranges::find(names, name) == names.end()) {
        throw SetupError(fmt::format("the prior of gyro {} names drift coefficient '{}'", number, name),
                         fmt::format("the drift model has {}", fmt::join(names, ", ")));
      }
    }
  }
  const auto value_or = [](const std::map<std::string, double>& table, const std::string& name, double otherwise) {
    const auto found = table.find(name);
    return found == table.end() ? otherwise : found->second;
  };
  GyroParameters mean;
  mean.drift_rad_s.resize(family.size());
  Eigen::VectorXd sigma(family.size() + 3);
  for (int i = 0; i < family.size(); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    mean.drift_rad_s(i) = value_or(prior.drift_rad_s, name, 0);
    sigma(i) = value_or(prior.drift_sigma_rad_s, name, family.prior_factor(i) * prior.drift_common_sigma_rad_s);
  }
  mean.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(prior.alignment_rotation_vector_rad)).raw();
  sigma.tail<3>() = prior.alignment_sigma_rad;
  return {mean, sigma};
}

ParameterPrior prior_of_calibration(const Calibration& earlier, int gyros, const DriftFamily& family) {
  ParameterPrior prior;
  std::vector<Eigen::Index> rows;
  for (const std::string& name : state_names(family, gyros)) {
    const auto found = std::ranges::find(earlier.states, name);
    if (found == earlier.states.end()) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name),
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

DriftFamily family_of(const std::string& drift_model) {
  const auto family = DriftFamily::named(drift_model);
  if (!family) {
    throw SetupError(fmt::format("there is no drift model '{}'", drift_model), fmt::format("use {}", kDriftModels));
  }
  return *family;
}

DriftFamily family_of(const GyroCalibration& gyro) {
  const DriftFamily family = family_of(gyro.drift_model);
  if (!std::ranges::equal(gyro.drift_rad_s, family.names(), {}, [](const auto& pair) { return pair.first; })) {
    throw SetupError(fmt::format("a gyro's coefficients are not those of drift model {}", gyro.drift_model),
                     fmt::format("give {}", fmt::join(family.names(), ", ")));
  }
  return family;
}

Eigen::Vector3d seen_in_c(const GyroParameters& gyro, const Eigen::Vector3d& h_b) {
  return gyro.C_c_b * without_bias<double>(h_b, gyro.readout_bias);
}

GyroParameters parameters_of(const GyroCalibration& gyro, const DriftFamily& family) {
  GyroParameters parameters;
  parameters.drift_rad_s.setZero(family.size());
  for (int i = 0; i < family.size(); ++i) {
    const std::string& name = family.names()[static_cast<std::size_t>(i)];
    const auto found = std::ranges::find(gyro.drift_rad_s, name, [](const auto& pair) { return pair.first; });
    parameters.drift_rad_s(i) = found == gyro.drift_rad_s.end() ? 0 : found->second;
  }
  parameters.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
  parameters.readout_bias = gyro.readout_bias;
  return parameters;
}

GyroCalibration record_of(const GyroParameters& parameters, const std::string& drift_model, const DriftFamily& family) {
  GyroCalibration record;
  record.drift_model = drift_model;
  for (int i = 0; i < family.size(); ++i) {
    record.drift_rad_s.emplace_back(family.names()[static_cast<std::size_t>(i)], parameters.drift_rad_s(i));
  }
  record.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(parameters.C_c_b).log().raw();
  record.readout_bias = parameters.readout_bias;
  return record;
}

std::vector<std::string> state_names(const DriftFamily& family, int gyros) {
  std::vector<std::string> names;
  for (int k = 1; k <= gyros; ++k) {
    for (const std::string& coefficient : family.names()) {
      names.push_back(fmt::format("gyro{}.{}", k, coefficient));
    }
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(fmt::format("gyro{}.align_{}", k, axis));
    }
  }
  return names;
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
