#pragma once
/// Space packets as they are read: the tables that they hold.

#include <filesystem>
#include <string_view>
#include <vector>

#include "telemetry_map.hpp"
#include "telemetry_table.hpp"

namespace trihedron::io {

struct PacketTables {
  /// That of the gyros, with columns h1_x, h1_y, h1_z, h2_x …, then one of each star tracker with q_x, q_y, q_z, q_w;
  /// NaN where a report says that they are not valid.
  std::vector<ForeignTable> tables;
  std::vector<Defect> defects;  ///< packets that were left out, are missing, or of something else
};

/// `file` is for messages. Throws InputRefused where a packet does not follow on the one before, the last is cut short,
/// a report has another layout than it should, or there is none of a source.
[[nodiscard]] PacketTables parse_packets(std::string_view bytes, const std::filesystem::path& file,
                                         const PacketMap& map, std::size_t star_trackers);

}  // namespace trihedron::io
