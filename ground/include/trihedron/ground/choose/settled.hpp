#pragma once
/// What an estimator on board is to estimate, which nothing but what is known before a pass can say.

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Settles before the first event what the options leave open, for a Pipeline: by the earlier calibration, or else
/// drift model esg20, clock offset and error at orbital period, with priors that allow for their absence. The noise is
/// that of the options. Of an earlier calibration with a drift field an estimator on board has the model of
/// drift_on_board(). Throws SetupError.
[[nodiscard]] CalibrationOptions settled_before(const PassSettings& settings, CalibrationOptions options);

/// For a Pipeline as well, but what the options leave open is left out: eq. (1) alone, the noise of the settings, no
/// further states.
[[nodiscard]] CalibrationOptions settled_as_told(CalibrationOptions options);

/// As settled_before() for what is flown event by event. Where the navigator takes over the estimates, their sigmas are
/// widened where the innovations are correlated in time.
[[nodiscard]] CalibrationOptions settled_for_flight(const PassSettings& settings, const CalibrationOptions& options);

}  // namespace trihedron::ground
