#pragma once
/// What is wrong with telemetry, whatever format it came in.

#include <vector>

#include "series.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {

/// A shorter pass is refused.
inline constexpr Duration kShortestPass = std::chrono::minutes(1);

/// Gyro rows (columns h1_x, h1_y, …) with increasing times; appends the defects found. Throws InputRefused when nothing
/// can be done with them: no sample, less than a minute, another period than that of the settings, a gyro without one
/// usable direction. `settings_file`: where the settings stand, for that message.
[[nodiscard]] GyroTelemetry screen_gyro(Series series, const PassSettings& settings,
                                        const std::filesystem::path& settings_file, std::vector<Defect>& defects);

/// Fixes (columns q_x, q_y, q_z, q_w), likewise. Throws InputRefused when not one is usable.
[[nodiscard]] StarTrackerTelemetry screen_star_tracker(Series series, const PassSettings& settings,
                                                       const std::filesystem::path& settings_file,
                                                       std::vector<Defect>& defects);

/// The rows that can stay so that times strictly increase, as many as possible; of equal times the first. `rows` index
/// `t`.
[[nodiscard]] std::vector<std::size_t> longest_increasing(const std::vector<Time>& t, std::vector<std::size_t> rows);

}  // namespace trihedron::io
