#pragma once
/// Attitude files: `t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad,age_s`, CSV; q_in_c, sigmas about
/// c x, y, z, time since the last astro-correction.

#include <filesystem>
#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// Further columns are skipped; without the sigma columns `sigma_rad` is empty, without age_s `age_s`. A sigma may be
/// NaN (unknown). Throws InputRefused for everything else that is not a clean solution: times that do not increase, a q
/// that is no unit quaternion, no row at all.
[[nodiscard]] AttitudeHistory read_attitude(const std::filesystem::path& path, Time epoch);

/// t_s with three decimals where that is exact, else nine; q with twelve. Columns of what is empty are not written.
[[nodiscard]] std::string format_attitude(Time epoch, const AttitudeHistory& attitude);

/// The first line where all columns are there.
inline constexpr std::string_view kAttitudeColumns = "t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad,age_s\n";
/// The lines after it.
[[nodiscard]] std::string format_attitude_rows(Time epoch, const AttitudeHistory& attitude);

/// That text. Throws MachineFailed when the file cannot be written; then nothing stays.
void write_attitude(const std::filesystem::path& path, Time epoch, const AttitudeHistory& attitude);

}  // namespace trihedron::io
