#pragma once
/// A pass as CCSDS space packets: telemetry reports of PUS-C, one for each sample and fix, and their description in
/// XTCE 1.2. docs/packets.md has the layout. A telemetry.toml with [telemetry.packets] reads them.

#include <cstddef>
#include <string>

#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// Application process identifier of the gyros; that of star tracker k is k more.
inline constexpr int kDefaultApid = 100;
/// The next one is that of idle packets.
inline constexpr int kLastApid = 2046;

/// The contents of the files that make up a pass.
struct PacketFiles {
  std::string packets;                   ///< one after the other, in order of time
  std::string xtce;                      ///< what they hold, for mission databases
  std::string toml;                      ///< telemetry.toml with the settings of the pass
  std::string prior;                     ///< the earlier calibration that the settings name; empty where there is none
  std::size_t covariances_left_out = 0;  ///< fixes with a covariance of their own, which packets do not hold
};

/// `packets_name` and `prior_name`: by which the telemetry.toml names the files. Numbers and times come back as they
/// are; a direction or quaternion that has a NaN is reported invalid. Covariances of fixes are left out: read again,
/// all fixes have the noise of the settings, and the telemetry.toml says so. Throws UsageError for an APID that leaves
/// no room for the star trackers, and for times outside 1958 to 2094, which the time code cannot hold.
[[nodiscard]] PacketFiles format_packets(const Pass& pass, int apid, const std::string& packets_name,
                                         const std::string& prior_name);

}  // namespace trihedron::io
