#include "model/drift_on_board.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "trihedron/records/drift_models.hpp"

namespace trihedron::ground {
namespace {

/// Drift that turns a momentum by less than 2″ in nine hours, even if it always goes the same way.
constexpr double kNegligible_rad_s = 3e-10;
/// A model leaves out no more of the root mean square of all members than this part, where another has room for it.
constexpr double kSmallPart = 0.03;

/// Mean square over the sphere of the drift of a member of unit mean square.
double over_sphere(const DriftCoefficient& member) {
  const double l = member.degree;
  return l * (l + 1) / (4 * std::numbers::pi);
}

/// About each of the two axes across the momentum, of the gyro with the most; of members that `counts`.
template <class Counts>
double root_mean_square(const MeanSquares& members, Counts&& counts) {
  double most = 0;
  for (const auto& gyro : members) {
    double sum = 0;
    for (const auto& [member, square] : gyro) {
      sum += counts(member) ? square * over_sphere(member) / 2 : 0;
    }
    most = std::max(most, sum);
  }
  return std::sqrt(most);
}

}  // namespace

bool knows_of_drift_outside(const PassSettings& settings) {
  return std::ranges::any_of(settings.gyros, [](const GyroPrior& prior) {
    const auto outside = [](const auto& coefficient) { return !coefficient.first.is_in_eq1(); };
    return std::ranges::any_of(prior.drift_rad_s, outside) || std::ranges::any_of(prior.drift_sigma_rad_s, outside);
  });
}

MeanSquares mean_squares_of(const Calibration& calibration) {
  MeanSquares squares(calibration.gyros.size());
  for (std::size_t k = 0; k < squares.size(); ++k) {
    for (const DriftCoefficient& member : coefficients_of(calibration.gyros[k].drift_model)) {
      if (member.member == DriftCoefficient::Member::kW || member.member == DriftCoefficient::Member::kD) {
        const ParameterId state = ParameterId::drift(k, member);
        const double value = value_of(calibration, state);
        const double sigma = sigma_of(calibration, state);
        squares[k][member] = value * value + sigma * sigma;
      }
    }
  }
  return squares;
}

DriftOnBoard drift_on_board(const MeanSquares& members, const DriftModelId& model) {
  const std::vector<DriftCoefficient> kept = coefficients_of(model);
  const double left_out = root_mean_square(
      members, [&](const DriftCoefficient& member) { return std::ranges::find(kept, member) == kept.end(); });
  return {model, left_out > kNegligible_rad_s ? left_out : 0};
}

DriftOnBoard drift_on_board(const MeanSquares& members) {
  const double all = root_mean_square(members, [](const DriftCoefficient&) { return true; });
  const double enough = std::max(kNegligible_rad_s, kSmallPart * all);
  DriftOnBoard found = drift_on_board(members, kEsg7);
  for (int degree = 1; degree <= DriftModelId::kMaxDegreeOnBoard && found.left_out_rad_s > enough; ++degree) {
    found = drift_on_board(members, vsh(degree));
  }
  return found;
}

void add_made_up(const LeftOut& left_out, const Calibration& all, MeanSquares& members) {
  const Eigen::VectorXd more =
      (left_out.made_up() * left_out.mean_squares() * left_out.made_up().transpose()).diagonal();
  for (std::size_t i = 0; i < left_out.kept().size(); ++i) {
    const ParameterId& state = all.states[static_cast<std::size_t>(left_out.kept()[i])];
    const auto its = members[state.gyro()].find(state.coefficient);
    if (state.is_drift() && its != members[state.gyro()].end()) {
      its->second += more(static_cast<Eigen::Index>(i));
    }
  }
}

void use(const DriftOnBoard& drift, CalibrationOptions& options) {
  options.drift_field = false;
  options.drift_model = drift.drift_model;
  if (drift.left_out_rad_s > 0) {
    FurtherStateOptions& states = options.further_states;
    const double before = states.is_on(FurtherState::kWanderingDrift) ? states.wandering_drift_rad_s : 0;
    states[FurtherState::kWanderingDrift] = FurtherStateOptions::Choice::kOn;
    states.wandering_drift_rad_s = std::hypot(before, drift.left_out_rad_s);
  }
}

void use_on_board(const Calibration& field, CalibrationOptions& options) {
  const std::optional<OnBoardDrift>& found = field.on_board_drift;
  if (found && (!options.drift_model || options.drift_model == found->drift_model)) {
    options.drift_field = false;
    options.drift_model = found->drift_model;
    double& walk = options.direction_random_walk_rad_sqrt_s;
    walk = std::hypot(walk, found->random_walk_rad_sqrt_s);
    return;
  }
  const MeanSquares members = mean_squares_of(field);
  use(options.drift_model ? drift_on_board(members, *options.drift_model) : drift_on_board(members), options);
}

void use(const MeanSquares& members, const DriftModelId& model, PassSettings& settings) {
  const std::vector<DriftCoefficient> kept = coefficients_of(model);
  for (std::size_t k = 0; k < members.size(); ++k) {
    for (const auto& [member, square] : members[k]) {
      if (std::ranges::find(kept, member) != kept.end()) {
        settings.gyros[k].drift_sigma_rad_s.try_emplace(member, std::sqrt(square));
      }
    }
  }
}

}  // namespace trihedron::ground
