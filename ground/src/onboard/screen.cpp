#include "onboard/screen.hpp"

#include <algorithm>

#include "model/gyro_model.hpp"
#include "onboard/setup.hpp"
#include "onboard/with_estimator.hpp"
#include "trihedron/ground/onboard/replay.hpp"

namespace trihedron::ground {
namespace {

/// Whether what is known before of a gyro names a coefficient that eq. (1) does not have.
bool knows_of_drift_outside(const PassSettings& settings) {
  return std::ranges::any_of(settings.gyros, [](const GyroPrior& prior) {
    const auto outside = [](const auto& coefficient) { return !coefficient.first.is_in_eq1(); };
    return std::ranges::any_of(prior.drift_rad_s, outside) || std::ranges::any_of(prior.drift_sigma_rad_s, outside);
  });
}

}  // namespace

CalibrationOptions without_further_states(CalibrationOptions options) {
  options.drift_model = kEsg7;
  options.further_states = FurtherStateOptions::none();
  return options;
}

Screened screen(const Pass& pass, const CalibrationOptions& asked) {
  CalibrationOptions options = without_further_states(asked);
  const bool has_prior_of_esg20 = pass.settings.prior && asked.drift_model == kEsg20;
  if (has_prior_of_esg20 || (asked.drift_model != kEsg7 && knows_of_drift_outside(pass.settings))) {
    options.drift_model = asked.drift_model.value_or(kEsg20);
  }
  return with_estimator(pass, options, [&]<class Estimator> {
    const auto cycle = make_cycle<Estimator>(pass, options, {.navigate = false});
    Screened screened;
    screened.pass.gyros = Estimator::kGyros;
    std::size_t sample = 0;
    replay(
        pass, *cycle, [&](const auto& report) { screened.pass.add_fix(report); },
        [&](const auto& report) { screened.pass.add_sample(pass.gyro, sample++, report); });
    screened.pass.keep_longest();
    for (const auto& gyro : cycle->estimator().gyros()) {
      screened.first.push_back(to_record<Esg7>(gyro));
    }
    return screened;
  });
}

}  // namespace trihedron::ground
