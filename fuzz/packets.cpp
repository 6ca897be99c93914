// Space packets. As CRCs that a fuzzer cannot guess would hide what is behind them, every packet is given the right one
// where the first octet of the input is odd.
#include "packets.hpp"

#include <algorithm>
#include <string>

#include "packet_layout.hpp"
#include "target.hpp"

namespace {

void seal(std::string& bytes) {
  for (std::size_t begin = 0; begin + 9 <= bytes.size();) {
    const std::size_t size = 7 + trihedron::io::bits_at(std::string_view(bytes).substr(begin), 32, 16);
    if (size < 9 || size > bytes.size() - begin) {
      return;
    }
    const unsigned crc = trihedron::io::packet_crc(std::string_view(bytes).substr(begin, size - 2));
    bytes[begin + size - 2] = static_cast<char>(crc >> 8U);
    bytes[begin + size - 1] = static_cast<char>(crc & 0xFFU);
    begin += size;
  }
}

}  // namespace

void trihedron::fuzz::read_packets(std::string_view bytes) {
  const bool is_sealed = !bytes.empty() && (static_cast<unsigned char>(bytes.front()) & 1U) != 0;
  std::string packets(bytes.substr(std::min<std::size_t>(1, bytes.size())));
  if (is_sealed) {
    seal(packets);
  }
  const io::PacketTables tables = io::parse_packets(packets, "telemetry.ccsds", {"telemetry.ccsds"}, 1);
  expect(tables.tables.size() == 2, "a table of the gyros and one of the star tracker");
  for (const io::ForeignTable& table : tables.tables) {
    expect(table.rows() > 0, "reports");
    for (const auto& column : table.numbers) {
      expect(column.size() == table.rows(), "a value for each stamp");
    }
  }
  for (const io::Defect& defect : tables.defects) {
    expect(defect.count > 0 && !defect.first.empty(), "a place for each defect");
  }
}
