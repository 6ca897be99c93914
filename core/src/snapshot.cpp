#include "trihedron/core/snapshot.hpp"

#include <cstring>

#include "trihedron/core/crc32.hpp"

namespace trihedron::detail {
namespace {

constexpr std::size_t kBeforeCrc = sizeof(SnapshotHeader) - sizeof(SnapshotHeader::crc);

std::uint32_t crc_of(const SnapshotHeader& header, std::span<const std::byte> state) {
  return crc32(state, crc32(std::as_bytes(std::span(&header, 1)).first(kBeforeCrc)));
}

}  // namespace

SlotContent look_into(std::span<const std::byte> slot, std::uint32_t layout) {
  SnapshotHeader header;
  const auto bytes = std::as_writable_bytes(std::span(&header, 1));
  std::memcpy(bytes.data(), slot.data(), bytes.size());
  const auto state = slot.subspan(bytes.size());
  if (header.magic != SnapshotHeader::kMagic || header.layout != layout || header.size != state.size()) {
    return {SnapshotAnswer::kForeign, 0};
  }
  if (header.crc != crc_of(header, state) || header.sequence == 0) {
    return {SnapshotAnswer::kCorrupted, 0};
  }
  return {SnapshotAnswer::kRestored, header.sequence};
}

void write_slot(std::span<std::byte> slot, std::uint32_t layout, std::uint64_t sequence,
                std::span<const std::byte> state) {
  SnapshotHeader header{.magic = SnapshotHeader::kMagic, .layout = layout, .sequence = sequence, .size = state.size()};
  header.crc = crc_of(header, state);
  const auto bytes = std::as_bytes(std::span(&header, 1));
  std::memcpy(slot.subspan(bytes.size()).data(), state.data(), state.size());
  std::memcpy(slot.data(), bytes.data(), bytes.size());
}

}  // namespace trihedron::detail
