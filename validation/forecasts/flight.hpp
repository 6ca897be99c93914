#pragma once
/// Simulated passes that are calibrated in their first part and flown open loop through the rest.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::forecasts {

/// A kind of passes.
struct World {
  std::string name;
  int number = 0;     ///< 1 …; no pass of one has the noise of one of another
  Scenario scenario;  ///< all but seed and duration
};
[[nodiscard]] std::vector<World> worlds();

/// An open loop some time after its correction: the error, mean of kAveraged epochs so that the noise of the readings,
/// of which the prediction is certain, does not hide the rest; and what was predicted of it.
struct Forecast {
  double corrected_min = 0;  ///< in the pass
  double after_min = 0;
  double square = 0;                   ///< of the error by the predicted covariance: χ² of three
  Eigen::Vector3d in_sigmas{0, 0, 0};  ///< roll, pitch, heading
  double error_rad = 0;                ///< total
  double error_997_rad = 0;            ///< predicted for the motion that was flown
  double error_997_continued_rad = 0;  ///< predicted where the motion after the calibration is not known
};

struct Flight {
  Duration calibrated{};          ///< the first part of the pass
  std::vector<Duration> after{};  ///< of the forecasts, ascending
};

/// Epochs of the truth, 3 s apart, that an error is the mean of: a minute, in which it moves little.
inline constexpr int kAveraged = 21;

/// One pass, number `run` of its world, by this estimator with these options: the open loop from the end of the
/// calibration; of estimator invariant also those from each correction in it but the first, with what was calibrated
/// until then.
[[nodiscard]] std::vector<Forecast> fly(const World& world, int run, const Flight& flight,
                                        const CalibrationOptions& options);

}  // namespace trihedron::forecasts
