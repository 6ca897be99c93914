#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace trihedron {

/// CRC-32 of Ethernet and zip: polynomial 0x04C11DB7, reflected (0xEDB88320), begun with all ones and inverted at the
/// end. `before`: that of the bytes before these. It finds every error of one to three bits in a state of up to 11 450
/// bytes, every error of one bit in any, every burst of up to 32 bits, and all but 2⁻³² of the others.
[[nodiscard]] std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before = 0);

}  // namespace trihedron
