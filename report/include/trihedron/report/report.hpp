#pragma once
/// The report of a calibration: one HTML text that holds everything it shows and opens offline.

#include <string>
#include <vector>

#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::report {

/// Refers to its parts; they must outlive it. Sections whose data are absent or empty are left out of the report.
struct ReportInput {
  const Pass& pass;
  const CalibrationRun& run;
  const Truth* truth = nullptr;
  std::vector<std::string> telemetry_notes;  ///< what was wrong with the telemetry as read, one sentence each
  const ground::CalibrationEvaluation* evaluation = nullptr;
};

/// The whole text of report.html, UTF-8. The same input gives the same text.
[[nodiscard]] std::string render(const ReportInput& input);

}  // namespace trihedron::report
