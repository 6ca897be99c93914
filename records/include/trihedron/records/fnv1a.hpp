#pragma once
/// A number for a text, the same on every machine and in every version.

#include <cstdint>
#include <string_view>

namespace trihedron {

/// FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo), 64 bit. Not for texts that somebody makes alike on purpose.
[[nodiscard]] constexpr std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  }
  return hash;
}

}  // namespace trihedron
