#pragma once
/// A calibration as CCSDS attitude comprehensive message (ACM version 2, 504.0-B-2), with its covariance beside it.
/// docs/interchange.md has the names of the user-defined keywords.

#include <filesystem>
#include <string>

#include "trihedron/io/attitude_message.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// What a message may have beside the calibration.
struct CalibrationContext {
  const AttitudeMessage* attitude = nullptr;  ///< states and, where it has sigmas, their covariance
  const PassSettings* pass = nullptr;         ///< noise and periods of the sensors
  std::string covariance_file;                ///< name that the message gives for the full covariance
};

/// Relative times count from the epoch of the calibration. Throws UsageError as expect_writable_description(), and for
/// TDB, in which seconds are not those of the calibration.
[[nodiscard]] std::string format_acm(const Calibration& calibration, const CalibrationContext& context,
                                     const MessageDescription& description, MessageSyntax syntax);

/// NetCDF-4: `covariance(state, state_2)` in the units of its states, with their names and units as `state` and
/// `units`. Throws MachineFailed.
void write_covariance(const std::filesystem::path& path, const Calibration& calibration);

}  // namespace trihedron::io
