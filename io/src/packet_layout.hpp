#pragma once
/// What the octets of our space packets mean: one table that is written by, read by, and that the XTCE is made of.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/time.hpp"

namespace trihedron::io {

enum class FieldKind { kUnsigned, kFlag, kTime, kFloat };

/// What holds of the value of a field.
enum class FieldRule {
  kVaries,
  kSelects,  ///< `value`; a packet with another one is of something else
  kMust,     ///< `value`, in each packet that is selected
  kWritten,  ///< `value` is written, any is read
};

/// The most significant bit comes first.
struct PacketField {
  std::string name;
  FieldKind kind{};
  int bits = 0;
  FieldRule rule = FieldRule::kVaries;
  std::uint64_t value = 0;
  std::string about;  ///< for people
};

/// A report.
struct PacketLayout {
  std::string name;
  int apid = 0;
  std::vector<PacketField> fields;  ///< without the CRC at the end

  [[nodiscard]] std::size_t octets() const;  ///< with the CRC
};

inline constexpr int kPrimaryHeaderOctets = 6;
inline constexpr int kCrcOctets = 2;
inline constexpr int kIdleApid = 2047;
/// Where the fields of the primary header begin that are needed to find the next packet, in bits.
inline constexpr std::size_t kApidBit = 5;
inline constexpr std::size_t kSequenceCountBit = 18;
inline constexpr std::size_t kLengthBit = 32;

/// Fields before the parameters of a report: primary and secondary header, and the structure ID.
[[nodiscard]] std::size_t header_fields();
[[nodiscard]] std::size_t header_octets();

[[nodiscard]] PacketLayout gyro_layout(int apid, int gyros);
/// `number` of the star tracker, from 1.
[[nodiscard]] PacketLayout star_tracker_layout(int apid, int number);
/// The gyros, then each star tracker: APIDs follow on each other.
[[nodiscard]] std::vector<PacketLayout> layouts_of(int apid, int gyros, std::size_t star_trackers);

/// At most 64 bits, which begin an octet where they are more than 57.
[[nodiscard]] std::uint64_t bits_at(std::string_view octets, std::size_t bit, int bits);
/// CRC-16-CCITT as in ECSS-E-ST-70-41C, annex B: polynomial 0x1021, begins with 0xFFFF.
[[nodiscard]] std::uint16_t packet_crc(std::string_view octets);

/// CUC of 4 + 4 octets since 1958-01-01 TAI, in units of 2^-32 s; exact to the nanosecond, from 1958 to 2094.
[[nodiscard]] std::uint64_t cuc_of(Time t);
[[nodiscard]] Time time_of_cuc(std::uint64_t cuc);
inline constexpr Time kCucEnd = Time(Duration(std::chrono::seconds(std::int64_t{1} << 32U)));

/// Appends a packet; `varying` are the values of the fields that vary, in their order.
void append_packet(std::string& out, const PacketLayout& layout, const std::vector<std::uint64_t>& varying);

/// The description of these reports.
[[nodiscard]] std::string format_xtce(const std::vector<PacketLayout>& layouts);

}  // namespace trihedron::io
