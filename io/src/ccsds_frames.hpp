#pragma once
/// Names of frames in CCSDS messages, of the SANA registries.

#include <string>
#include <string_view>

namespace trihedron::io {

/// Upper case, with underscores for blanks, as the standard takes for equal.
[[nodiscard]] std::string normalised(std::string_view name);

/// Whether axes of this name are inertial: ICRF, GCRF, EME2000 and J2000 and the like.
[[nodiscard]] bool is_inertial_frame(std::string_view normalised_name);
/// Whether it is a frame of the spacecraft: SC_BODY, SC_BODY_1, STARTRACKER_2, INSTRUMENT_A and the like.
[[nodiscard]] bool is_spacecraft_frame(std::string_view normalised_name);

/// For people.
inline constexpr std::string_view kInertialFrames = "ICRF, GCRF, EME2000, J2000";
inline constexpr std::string_view kSpacecraftFrames =
    "SC_BODY_1, AST_1, STARTRACKER_1, INSTRUMENT_1, GYRO_FRAME_1, IMU_FRAME_1, SENSOR_1";

}  // namespace trihedron::io
