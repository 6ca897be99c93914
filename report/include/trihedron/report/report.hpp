#pragma once
/// The report of a calibration: one HTML text that holds everything it shows and opens offline.

#include <optional>
#include <string>
#include <vector>

#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::report {

/// Reference of the attitude evaluation, and the errors against it.
struct Evaluation {
  std::string reference;  ///< in words, as in "the error against …": "the simulated truth", "the star tracker"
  ground::AttitudeErrors navigation;          ///< of CalibrationRun::navigation
  ground::AttitudeErrors attitude;            ///< of CalibrationRun::attitude
  std::vector<ground::OpenLoops> open_loops;  ///< from the run's corrections; may be empty
  double limit_rad = 0;                       ///< error limit of the correction intervals
};

/// Refers to its parts; they must outlive it. Sections whose data are absent or empty are left out of the report.
struct ReportInput {
  const Pass& pass;
  const CalibrationRun& run;
  const Truth* truth = nullptr;
  std::vector<std::string> telemetry_notes;  ///< what was wrong with the telemetry as read, one sentence each
  std::optional<Evaluation> evaluation;
};

/// The whole text of report.html, UTF-8. The same input gives the same text.
[[nodiscard]] std::string render(const ReportInput& input);

}  // namespace trihedron::report
