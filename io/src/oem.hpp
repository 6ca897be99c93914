#pragma once
/// CCSDS orbit ephemeris messages (OEM), CCSDS 502.0-B: versions 1, 2 and 3, KVN or XML.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::io {

/// Position and velocity about the Earth, inertial axes. The times of its segments count from `epoch`.
struct OrbitMessage {
  std::string format;  ///< for people: "CCSDS OEM version 2, KVN"
  std::string object_name;
  std::string inertial_frame;
  std::string time_system;
  std::vector<EphemerisSegment> segments;  ///< in order; where one is useable no other is
};

/// Whether a text says that it is an OEM.
[[nodiscard]] bool is_orbit_message(std::string_view text);

/// `epoch`: what times are counted from. Throws InputRefused with line and column.
[[nodiscard]] OrbitMessage parse_orbit_message(std::string_view text, const std::filesystem::path& file, Time epoch);

}  // namespace trihedron::io
