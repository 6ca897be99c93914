#include "model/prior.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "model/left_out.hpp"
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
        throw SetupError(
            fmt::format("the prior of gyro {} names drift coefficient '{}'", number, name_of(coefficient)),
            fmt::format("name a drift model that has it (--drift-model), or take it out; {} has {}",
                        name_of(layout.drift_model), fmt::join(coefficient_names(layout.drift_model), ", ")));
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

/// What drift that comes back becomes where it is told from the epoch on: by its angle then, sine and cosine turn into
/// each other.
Eigen::MatrixXd turn_of_amplitudes(const Calibration& earlier, const Layout& layout, Time epoch) {
  Eigen::MatrixXd turn = Eigen::MatrixXd::Identity(layout.amplitudes_size(), layout.amplitudes_size());
  const auto put = [&](Eigen::Index first, Eigen::Index half, double angle) {
    const auto unit = Eigen::MatrixXd::Identity(half, half);
    turn.block(first, first, half, half) = turn.block(first + half, first + half, half, half) = std::cos(angle) * unit;
    turn.block(first + half, first, half, half) = std::sin(angle) * unit;
    turn.block(first, first + half, half, half) = -std::sin(angle) * unit;
  };
  for (int k = 0; k < layout.gyros; ++k) {
    const GyroCalibration& gyro = earlier.gyros[static_cast<std::size_t>(k)];
    if (layout.further.orbital_drift && gyro.orbital_drift) {
      put(layout.orbital_drift(k) - layout.amplitudes(), Layout::kOrbitalDrift / 2, gyro.orbital_drift->phase(epoch));
    }
    if (layout.further.polhode && gyro.polhode) {
      put(layout.polhode(k) - layout.amplitudes(), Layout::kEq1, gyro.polhode->angle_rad(epoch));
    }
  }
  return turn;
}

/// Drift that comes back is told from the epoch of the pass on, as in the set-up. Its amplitudes have a common prior
/// with the other parameters where the earlier calibration has those of the layout.
Prior prior_of_calibration(const Calibration& earlier, const Layout& layout, Time epoch) {
  const Calibration reduced = LeftOut(earlier, layout.drift_model).reduced();
  Prior prior;
  prior.covariance = reduced.covariance;
  const Eigen::Index amplitudes = layout.amplitudes_size();
  const Eigen::MatrixXd& of_amplitudes = reduced.amplitude_covariance;
  if (amplitudes > 0 && of_amplitudes.rows() == amplitudes) {
    const Eigen::MatrixXd turn = turn_of_amplitudes(reduced, layout, epoch);
    const Eigen::Index known = layout.parameters();
    prior.covariance.conservativeResize(known + amplitudes, known + amplitudes);
    prior.covariance.bottomLeftCorner(amplitudes, known) = turn * of_amplitudes.leftCols(known);
    prior.covariance.topRightCorner(known, amplitudes) =
        prior.covariance.bottomLeftCorner(amplitudes, known).transpose();
    prior.covariance.bottomRightCorner(amplitudes, amplitudes) =
        turn * of_amplitudes.rightCols(amplitudes) * turn.transpose();
  }
  for (int k = 0; k < layout.gyros; ++k) {
    GyroCalibration record = reduced.gyros[static_cast<std::size_t>(k)];
    if (record.orbital_drift) {
      record.orbital_drift = record.orbital_drift->from(epoch);
    }
    if (record.polhode) {
      record.polhode = record.polhode->from(epoch);
    }
    prior.gyros[k] = gyro_of(record, layout);
  }
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
  if (layout.further.orbital_drift && record.orbital_drift) {
    gyro.drift_rad_s.segment<Layout::kOrbitalDrift>(layout.orbital_column()) << record.orbital_drift->sine_rad_s,
        record.orbital_drift->cosine_rad_s;
  }
  if (layout.further.polhode && record.polhode) {
    gyro.drift_rad_s.segment<Layout::kPolhode>(layout.polhode_column()) << record.polhode->sine_rad_s,
        record.polhode->cosine_rad_s;
  }
  return gyro;
}

GyroCalibration record_of(const Gyro& gyro, int k, const CalibrationSetup& setup, double part_of_change) {
  const Layout& layout = setup.layout;
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
  if (layout.further.orbital_drift) {
    const int column = layout.orbital_column();
    record.orbital_drift = {gyro.drift_rad_s.segment<3>(column), gyro.drift_rad_s.segment<3>(column + 3),
                            setup.orbital_rate_rad_s, setup.orbital_phase_zero};
  }
  if (layout.further.polhode) {
    const int column = layout.polhode_column();
    record.polhode = {setup.polhodes[k], setup.orbital_phase_zero, gyro.drift_rad_s.segment<Layout::kEq1>(column),
                      gyro.drift_rad_s.segment<Layout::kEq1>(column + Layout::kEq1)};
  }
  return record;
}

DriftTime drift_time(const GyroCalibration& record, Time t) {
  DriftTime time;
  if (record.orbital_drift) {
    const double phase = record.orbital_drift->phase(t);
    time.orbital_sine = std::sin(phase);
    time.orbital_cosine = std::cos(phase);
  }
  if (record.polhode) {
    const double angle = record.polhode->angle_rad(t);
    time.polhode_sine = std::sin(angle);
    time.polhode_cosine = std::cos(angle);
  }
  return time;
}

Layout layout_of(const GyroCalibration& record) {
  return {.drift_model = record.drift_model,
          .further = {.orbital_drift = record.orbital_drift.has_value(), .polhode = record.polhode.has_value()}};
}

Prior prior_of(const PassSettings& settings, const Layout& layout) {
  if (settings.prior) {
    return prior_of_calibration(*settings.prior, layout, settings.epoch);
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
