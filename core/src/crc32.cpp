#include "trihedron/core/crc32.hpp"

namespace trihedron {
namespace {

/// Eight bytes at once ("slicing by 8"): table n is for a byte with n more bytes behind it.
constexpr std::size_t kBytesAtOnce = 8;

constexpr auto kTables = [] {
  constexpr std::uint32_t kReflected = 0xEDB88320;
  std::array<std::array<std::uint32_t, 256>, kBytesAtOnce> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1) != 0 ? crc >> 1 ^ kReflected : crc >> 1;
    }
    tables[0][byte] = crc;
  }
  for (std::size_t n = 1; n < kBytesAtOnce; ++n) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t shorter = tables[n - 1][byte];
      tables[n][byte] = shorter >> 8 ^ tables[0][shorter & 0xFF];
    }
  }
  return tables;
}();

}  // namespace

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before) {
  const auto value = [&](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
  std::uint32_t crc = ~before;
  const std::size_t whole = bytes.size() / kBytesAtOnce * kBytesAtOnce;
  for (std::size_t i = 0; i < whole; i += kBytesAtOnce) {
    crc ^= value(i) | value(i + 1) << 8 | value(i + 2) << 16 | value(i + 3) << 24;
    crc = kTables[7][crc & 0xFF] ^ kTables[6][crc >> 8 & 0xFF] ^ kTables[5][crc >> 16 & 0xFF] ^ kTables[4][crc >> 24] ^
          kTables[3][value(i + 4)] ^ kTables[2][value(i + 5)] ^ kTables[1][value(i + 6)] ^ kTables[0][value(i + 7)];
  }
  for (std::size_t i = whole; i < bytes.size(); ++i) {
    crc = crc >> 8 ^ kTables[0][(crc ^ value(i)) & 0xFF];
  }
  return ~crc;
}

}  // namespace trihedron
