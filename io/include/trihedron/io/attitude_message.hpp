#pragma once
/// Attitude ephemeris and parameter messages: CCSDS 504.0-B-2, AEM and APM version 2, as text (KVN) and XML; an AEM of
/// version 1 is read as well.
/// docs/interchange.md has the conventions.
///
/// The quaternion "from REF_FRAME_A to REF_FRAME_B" of the standard (annex F) turns components in B into components in
/// A by v_A = q ⊗ v_B ⊗ q*. With the inertial frame as A and c as B it is q_in_c, number by number, scalar last.

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/io/time_scale.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// What a message says beside the attitude.
struct MessageDescription {
  std::string object_name = "UNKNOWN";
  std::string object_id = "UNKNOWN";  ///< international designator, 2006-021A
  std::string originator = "TRIHEDRON";
  std::string inertial_frame = "GCRF";   ///< the axes of `in`: those of ICRF, with the origin at the Earth
  std::string body_frame = "SC_BODY_1";  ///< the axes of c
  TimeScale time_scale = TimeScale::kTai;
  std::string created_utc;  ///< creation date
};

/// Throws UsageError for a frame that read_attitude_message() would not take, and for texts that a message cannot hold.
void expect_writable_description(const MessageDescription& description);

/// Steps of more than 1.5 times the median step.
[[nodiscard]] Duration usual_gap(const AttitudeHistory& attitude);
/// Where the stretches without a gap begin: rows, and the number of rows at the end. A gap is a step longer than `gap`.
[[nodiscard]] std::vector<std::size_t> stretches(const AttitudeHistory& attitude, Duration gap);
/// The two forms of a CCSDS navigation data message.
enum class MessageSyntax { kKvn, kXml };

/// An AEM version 2 with one segment for each stretch without a gap: QUATERNION/ANGVEL where there are rates (of c with
/// respect to in, c axes), else QUATERNION. Numbers have 16 digits, the most that the standard allows, which is exact
/// to 5e-17. `epoch`, that of the attitude file, stands in a comment, by which read_attitude_message() finds it again.
/// Throws UsageError as expect_writable_description() and TimeText::format().
[[nodiscard]] std::string format_aem(const AttitudeHistory& attitude, std::span<const Eigen::Vector3d> rate_rad_s,
                                     Time epoch, const MessageDescription& description, Duration gap,
                                     MessageSyntax syntax);

/// A message, or a C-kernel, as attitude.
struct AttitudeMessage {
  AttitudeHistory attitude;
  std::vector<Eigen::Vector3d> rate_rad_s;  ///< of c with respect to in, c axes; empty where unknown
  std::string format;                       ///< for people: "CCSDS AEM version 2, KVN"
  std::string object_name;
  std::string object_id;
  std::string inertial_frame;
  std::string body_frame;
  std::string time_system;
  std::optional<Time> epoch;  ///< of t_s in the attitude file that the message was made from
  std::size_t segments = 0;
  std::size_t left_out = 0;  ///< rows outside the useable span of their segment, or that the next segment has again
};

/// An APM version 2 of the epoch of one row: quaternion and, where there are rates, angular velocity. `epoch` as in
/// format_aem(). Throws UsageError as that.
[[nodiscard]] std::string format_apm(const AttitudeMessage& attitude, std::size_t row, Time epoch,
                                     const MessageDescription& description, MessageSyntax syntax);

/// Whether a text is meant as such a message, by its beginning.
[[nodiscard]] bool is_attitude_message(std::string_view text);

/// Reads every segment. Throws InputRefused with line, reason and cure for all that is not an AEM, or an APM version 2,
/// of quaternions between one inertial frame and one of the spacecraft's.
[[nodiscard]] AttitudeMessage parse_attitude_message(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] AttitudeMessage read_attitude_message(const std::filesystem::path& file);  ///< Of a file.
/// Same, a C-kernel of SPICE with its clock beside it, or an attitude file (CSV), which needs the epoch that its t_s
/// counts from: throws UsageError where that is not given.
[[nodiscard]] AttitudeMessage read_attitude_of_any_format(const std::filesystem::path& path,
                                                          std::optional<Time> given_epoch);

}  // namespace trihedron::io
