#include "model/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "model/orbital_rate.hpp"
#include "model/prior.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/further_state.hpp"

namespace trihedron::ground {
namespace {

/// Prior sigma of the change of a coefficient over a pass, as a fraction of that of the coefficient.
constexpr double kChangeSigma = 0.05;
/// The same of a course that was found: a warm-up, a jump, or the polhode.
constexpr double kFoundChangeSigma = 0.3;
/// Prior sigma of each amplitude of the drift at orbital period, as a fraction of that of a coefficient.
constexpr double kOrbitalDriftSigma = 0.05;

/// The largest sigma of a component of such a state that an earlier calibration has left; 0 without it.
double sigma_before(const std::optional<Calibration>& earlier, FurtherState state) {
  double sigma = 0;
  if (earlier) {
    for (const FurtherEstimate& estimate : earlier->further) {
      sigma = estimate.parameter.is_further(state) ? std::max(sigma, estimate.sigma) : sigma;
    }
  }
  return sigma;
}

}  // namespace

double first_orbital_rate_rad_s(const PassSettings& settings) {
  const std::optional<double> before = settings.prior ? settings.prior->orbital_rate_rad_s : std::nullopt;
  return before.value_or(kLowOrbit_rad_s);
}

Layout layout_of(const PassSettings& settings, const CalibrationOptions& options) {
  if (!options.drift_model) {
    throw SetupError("the drift model is left open", fmt::format("use {}", drift_model_choices()));
  }
  refuse_unknown(*options.drift_model);
  if (options.estimator != Estimator::kBatch) {
    if (options.drift_field) {
      throw SetupError("the drift field is estimated from a whole pass, by estimator batch alone",
                       "use estimator batch, or name a drift model");
    }
    if (options.drift_model->degree > DriftModelId::kMaxDegreeOnBoard) {
      throw SetupError(
          fmt::format("drift model {} is too large for estimator {}", name_of(*options.drift_model),
                      name_of(options.estimator)),
          fmt::format("use estimator batch, or {} at most", name_of(vsh(DriftModelId::kMaxDegreeOnBoard))));
    }
  }
  const int gyros = static_cast<int>(settings.gyros.size());
  if (gyros < 2 || gyros > kMaxGyros) {
    throw SetupError(fmt::format("a calibration needs two to {} gyros; the pass has {}", kMaxGyros, gyros),
                     "give telemetry of a pair");
  }
  if (settings.further_star_trackers.size() + 1 > kMaxStarTrackers) {
    throw SetupError(fmt::format("there are {} star trackers", settings.further_star_trackers.size() + 1),
                     fmt::format("leave out some: at most {} are used", kMaxStarTrackers));
  }
  const FurtherStateOptions& states = options.further_states;
  Layout layout;
  layout.drift_model = *options.drift_model;
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    if (kind.flag != nullptr) {
      layout.further.*kind.flag = states.is_on(kind.state);
    }
  }
  if (options.estimator == Estimator::kPaper) {  // of two gyros and one star tracker, whatever else there is
    if (!(layout == Layout{})) {
      throw SetupError("estimator paper has eq. (1) alone, and no further states",
                       "use drift model esg7 and set all further states to off or auto, or use estimator invariant");
    }
    return layout;
  }
  layout.gyros = gyros;
  layout.star_trackers = 1 + static_cast<int>(settings.further_star_trackers.size());
  return layout;
}

CalibrationSetup setup_of(const PassSettings& settings, const CalibrationOptions& options) {
  CalibrationSetup setup;
  setup.layout = layout_of(settings, options);
  for (int k = 0; k < setup.layout.gyros; ++k) {
    setup.readout_noise_rad[k] = settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
  }
  setup.star_trackers[0].noise_rad = options.star_tracker_noise_rad.value_or(settings.star_tracker_noise_rad);
  if (options.star_tracker_noise_rad) {
    setup.over_told_covariance = options.star_tracker_noise_rad->cwiseQuotient(settings.star_tracker_noise_rad);
  }
  for (int head = 1; head < setup.layout.star_trackers; ++head) {
    const FurtherStarTracker& tracker = settings.further_star_trackers[static_cast<std::size_t>(head - 1)];
    StarTrackerSetup& its = setup.star_trackers[static_cast<std::size_t>(head)];
    its.noise_rad = tracker.noise_rad;
    its.C_c_s = Rot<C, C>::exp(Vec<C>::assume(tracker.mounting_rotation_vector_rad)).raw();
    its.alignment_sigma_rad = tracker.alignment_prior_sigma_rad;
  }
  if (settings.gyro_period > Duration::zero()) {
    setup.gyro_period = settings.gyro_period;
  }
  setup.direction_random_walk_rad_sqrt_s = options.direction_random_walk_rad_sqrt_s;

  const FurtherStateOptions& states = options.further_states;
  setup.wandering_drift = {states.wandering_drift_rad_s, to_seconds(states.wandering_time)};
  setup.further_sigma[FurtherState::kOrbitalDrift] = kOrbitalDriftSigma * settings.gyros[0].drift_common_sigma_rad_s;
  setup.further_sigma[FurtherState::kPolhode] = kFoundChangeSigma * settings.gyros[0].drift_common_sigma_rad_s;
  for (const FurtherState of_gyros :
       {FurtherState::kReadoutBias, FurtherState::kOrbitalDrift, FurtherState::kPolhode}) {
    if (const double sigma = sigma_before(settings.prior, of_gyros); sigma > 0) {
      setup.further_sigma[of_gyros] = sigma;
    }
  }
  setup.change.kind = states.change_course;
  setup.further_sigma[FurtherState::kCoefficientChange] =
      (setup.change.kind == CourseOfChange::Kind::kEven ? kChangeSigma : kFoundChangeSigma) *
      settings.gyros[0].drift_common_sigma_rad_s;
  setup.change.begin = settings.epoch;
  setup.change.time_s = to_seconds(states.change_time);
  setup.change.zero_at = settings.epoch;
  if (settings.duration > Duration::zero()) {
    setup.change.duration_s = to_seconds(settings.duration);
  }
  setup.orbital_rate_rad_s = options.orbital_rate_rad_s.value_or(first_orbital_rate_rad_s(settings));
  setup.orbital_phase_zero = settings.epoch;
  setup.polhodes = states.polhodes;

  setup.gate_nis = options.gate_nis;
  setup.reopen_after_rejections = options.reopen_after_rejections;
  setup.reopen_after_jump_rejections = options.reopen_after_jump_rejections;
  setup.widen_where_correlated = options.widen_where_correlated;
  setup.student_t_freedom = options.student_t_freedom;
  setup.angles_after = options.angles_after;
  return setup;
}

CorrectionPolicy policy_of(const CorrectionOptions& options) {
  CorrectionPolicy policy;
  policy.take_parameters = options.take_parameters;
  switch (options.when) {
    case CorrectionOptions::When::kEvery:
      policy.interval = options.interval;
      break;
    case CorrectionOptions::When::kOnlyFirst:
      policy.interval = CorrectionPolicy::kOnlyFirst;
      break;
    case CorrectionOptions::When::kEachFix:
      policy.interval = CorrectionPolicy::kEveryFix;
      break;
  }
  return policy;
}

std::vector<ParameterId> further_parameters(const Layout& layout) {
  std::vector<ParameterId> parameters;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (!layout.has(row.state) || row.components.empty()) {  // not there, or does not last
      continue;
    }
    const Layout::Owners owners = layout.owners(row.state);
    for (int owner = owners.begin; owner < owners.end; ++owner) {
      for (int component = 0; component < kind_of(row.state).size; ++component) {
        parameters.push_back(ParameterId::further(row.state, static_cast<std::size_t>(owner), component));
      }
    }
  }
  return parameters;
}

int state_of(const Layout& layout, const ParameterId& parameter) {
  return layout.first(parameter.further_state, parameter.owner) + parameter.component;
}

double value_of(const Layout& layout, const Gyros& gyros, const SharedStates& shared, const ParameterId& parameter) {
  const Gyro& gyro = gyros[parameter.owner];
  const int state = state_of(layout, parameter);
  if (parameter.further_state == FurtherState::kWanderingDrift) {
    return gyro.drift_rad_s(layout.wandering_column() + parameter.component);
  }
  if (parameter.further_state == FurtherState::kOrbitalDrift) {
    return gyro.drift_rad_s(layout.orbital_column() + parameter.component);
  }
  if (parameter.further_state == FurtherState::kPolhode) {
    return gyro.drift_rad_s(layout.polhode_column() + parameter.component);
  }
  if (state < layout.change(0)) {
    return gyro.errors(layout)(state - layout.readout(parameter.owner));
  }
  return state < layout.shared() ? gyro.drift_rad_s(layout.change_column() + parameter.component)
                                 : shared(state - layout.shared());
}

}  // namespace trihedron::ground
