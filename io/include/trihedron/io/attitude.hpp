#pragma once
/// Attitude files: `t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad,age_s`, CSV; q_in_c, sigmas about
/// c x, y, z, time since the last astro-correction. `rate_x_rad_s,rate_y_rad_s,rate_z_rad_s` may follow: of c with
/// respect to in, c axes. `q_body_x,q_body_y,q_body_z,q_body_w` come last where the pass tells how the star tracker
/// stands in the body: q_in_body.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// Further columns are skipped; without the sigma columns `sigma_rad` is empty, without age_s `age_s`. A sigma may be
/// NaN (unknown). Throws InputRefused for everything else that is not a clean solution: times that do not increase, a q
/// that is no unit quaternion, no row at all. A message (attitude_message.hpp) or C-kernel is read as well, whatever
/// the file is called; it has epochs of its own, and its inertial frame is taken for that of the pass.
[[nodiscard]] AttitudeHistory read_attitude(const std::filesystem::path& path, Time epoch);

/// Of the components of q.
enum class AttitudeDigits {
  kTwelveDecimals,  ///< 1e-12 rad, less than any attitude is known to
  kAll,             ///< so many that each comes back bit for bit
};

/// Of the star tracker in the body, PassSettings::star_tracker_mounting_rotation_vector_rad.
using Mounting = std::optional<Eigen::Vector3d>;

/// t_s with three decimals where that is exact, else nine. Columns of what is empty are not written; the rates are
/// those of an AttitudeMessage.
[[nodiscard]] std::string format_attitude(Time epoch, const AttitudeHistory& attitude,
                                          AttitudeDigits digits = AttitudeDigits::kTwelveDecimals,
                                          std::span<const Eigen::Vector3d> rate_rad_s = {},
                                          const Mounting& mounting = std::nullopt);

/// The first line where all columns are there.
inline constexpr std::string_view kAttitudeColumns = "t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad,age_s\n";
/// The first line where there is a mounting.
[[nodiscard]] std::string attitude_header(const Mounting& mounting);
/// The lines after it.
[[nodiscard]] std::string format_attitude_rows(Time epoch, const AttitudeHistory& attitude,
                                               AttitudeDigits digits = AttitudeDigits::kTwelveDecimals,
                                               std::span<const Eigen::Vector3d> rate_rad_s = {},
                                               const Mounting& mounting = std::nullopt);

/// That text. Throws MachineFailed when the file cannot be written; then nothing stays.
void write_attitude(const std::filesystem::path& path, Time epoch, const AttitudeHistory& attitude,
                    const Mounting& mounting = std::nullopt);

}  // namespace trihedron::io
