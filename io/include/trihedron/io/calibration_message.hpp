#pragma once
/// A calibration as CCSDS attitude comprehensive message (ACM version 2, 504.0-B-2), with its covariance beside it.
/// docs/interchange.md has the names of the user-defined keywords.

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "trihedron/io/attitude_message.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// A slew: begin, end, and the attitude that it leads to.
struct Manoeuvre {
  Time begin{};
  Time end{};
  std::optional<Eigen::Quaterniond> target_q_in_c{};
};

/// Slews that an attitude shows: where it turns more than twice as fast as it does usually (the median), and faster
/// than 1e-3 rad/s. Nothing is said of steps longer than `gap`; turns less than a minute apart are one.
[[nodiscard]] std::vector<Manoeuvre> slews_of(const AttitudeHistory& attitude, Duration gap);

/// What a message may have beside the calibration.
struct CalibrationContext {
  const AttitudeMessage* attitude = nullptr;  ///< states and, where it has sigmas, their covariance
  const PassSettings* pass = nullptr;         ///< noise and periods of the sensors
  std::string covariance_file;                ///< name that the message gives for the full covariance
  std::vector<Manoeuvre> manoeuvres{};        ///< in order
  /// At each attitude the drift as the bias of rate gyros (ground::equivalent_gyro_bias_rad_s), c axes; empty: none is
  /// written.
  std::vector<Eigen::Vector3d> gyro_bias_rad_s{};
};

/// Relative times count from the epoch of the calibration. Throws UsageError as expect_writable_description(), and for
/// TDB, in which seconds are not those of the calibration.
[[nodiscard]] std::string format_acm(const Calibration& calibration, const CalibrationContext& context,
                                     const MessageDescription& description, MessageSyntax syntax);

/// A calibration as read from such a message.
struct CalibrationMessage {
  Calibration calibration;
  std::string format;  ///< for people: "CCSDS ACM version 2, KVN"
  std::string object_name;
  std::string object_id;
  std::string inertial_frame;
  std::string body_frame;
  std::string time_system;
  /// Beside the message; empty where it names none.
  std::filesystem::path covariance_file;
  /// Whether the covariance is that of the file; else it is diagonal, from the sigmas in the message.
  bool has_full_covariance = false;
  std::vector<Manoeuvre> manoeuvres{};  ///< its blocks MAN; of no meaning to the calibration
};

/// Whether a text says that it is an ACM.
[[nodiscard]] bool is_calibration_message(std::string_view text);

/// Reads what format_acm() writes. A covariance file that is named but not there is no error. Not in a message, hence
/// lost: the forecast, the texts of findings, statistics that are not finite. Throws InputRefused with line, reason
/// and cure.
[[nodiscard]] CalibrationMessage parse_calibration_message(std::string_view text, const std::filesystem::path& file);

/// Same, or attitude, by what the file says it is.
[[nodiscard]] std::variant<AttitudeMessage, CalibrationMessage> read_message(const std::filesystem::path& file);

/// NetCDF-4: `covariance(state, state_2)` in the units of its states, with their names and units as `state` and
/// `units`. Throws MachineFailed.
void write_covariance(const std::filesystem::path& path, const Calibration& calibration);

}  // namespace trihedron::io
