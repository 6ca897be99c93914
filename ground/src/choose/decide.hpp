#pragma once
/// Which states beyond alignment and eq. (1), and which noise, a pass gives evidence of.

#include <optional>
#include <vector>

#include "choose/forecast.hpp"
#include "onboard/screen.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The options with nothing left to decide, `find_noise` saying whether it was found; and on what evidence.
struct Decision {
  CalibrationOptions options;
  std::vector<Evidence> evidence;    ///< empty where nothing was to be decided
  std::vector<Forecast> forecasts;   ///< of the drift models that were compared
  std::optional<Screened> screened;  ///< the screened pass by which it was decided, where it was
};

/// Settles each choice that is left to the program by the whole pass. Estimator paper has no further states; a prior
/// calibration tells them where the pass has one; else they are those that the pass makes 20 times as likely as their
/// absence. The noise is found where it is asked for, on a pass that is long enough and has no prior calibration.
/// Throws SetupError.
[[nodiscard]] Decision decide(const Pass& pass, const CalibrationOptions& asked);

/// Settles the same before the first event, as on board: by the earlier calibration, or else drift model esg20, clock
/// offset and error at orbital period, with priors that allow for their absence. The noise is that of the options.
/// Throws SetupError.
[[nodiscard]] CalibrationOptions settled_before(const PassSettings& settings, CalibrationOptions options);

}  // namespace trihedron::ground
