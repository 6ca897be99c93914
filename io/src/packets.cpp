#include "packets.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "packet_layout.hpp"
#include "pass_toml.hpp"
#include "toml_table.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/packets.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// A packet of a file.
struct Packet {
  std::int64_t number = 0;  ///< from 1
  std::size_t begin = 0;    ///< in octets
  std::string_view octets;

  [[nodiscard]] std::string place() const { return fmt::format("packet {}, at octet {}", number, begin); }
  [[nodiscard]] int apid() const { return static_cast<int>(bits_at(octets, kApidBit, 11)); }
};

void add_packet(Defect& defect, const Packet& packet, std::int64_t count = 1) {
  defect.count += count;
  if (defect.first.size() < Defect::kPlaces) {
    Place place;
    place.packet = packet.number;
    place.octet = static_cast<std::int64_t>(packet.begin);
    place.t_s = std::numeric_limits<double>::quiet_NaN();
    defect.first.push_back(place);
  }
}

/// The sequence counts of one APID, on a count that does not wrap around.
class Sequence {
 public:
  void add(std::uint64_t count, Time t, const Packet& packet) {
    const std::int64_t step = step_to(static_cast<std::int64_t>(count));
    // A count that does not go on although time does has begun anew.
    const bool begins_anew = step <= 0 && t > latest_;
    now_ = seen_.empty() ? static_cast<std::int64_t>(count) : begins_anew ? highest_ + 1 : now_ + step;
    offset_ = now_ - static_cast<std::int64_t>(count);
    note(packet);
    latest_ = std::max(latest_, t);
  }
  /// One whose header cannot be relied on.
  void add_damaged(const Packet& packet) {
    if (!seen_.empty()) {
      ++now_;
      note(packet);
    }
  }
  [[nodiscard]] Defect missing(std::string where) {
    Defect defect;
    defect.kind = Defect::Kind::kPacketsMissing;
    defect.where = std::move(where);
    std::ranges::sort(seen_, {}, &Seen::count);
    for (std::size_t i = 1; i < seen_.size(); ++i) {
      if (const std::int64_t step = seen_[i].count - seen_[i - 1].count; step > 1) {
        add_packet(defect, {seen_[i].number, seen_[i].begin, {}}, step - 1);
      }
    }
    return defect;
  }

 private:
  struct Seen {
    std::int64_t count = 0;
    std::int64_t number = 0;
    std::size_t begin = 0;
  };

  /// From -8192 to 8191.
  [[nodiscard]] std::int64_t step_to(std::int64_t count) const {
    constexpr std::int64_t kCounts = 16384;
    const std::int64_t step = (((count - (now_ - offset_)) % kCounts) + kCounts) % kCounts;
    return step < kCounts / 2 ? step : step - kCounts;
  }
  void note(const Packet& packet) {
    highest_ = seen_.empty() ? now_ : std::max(highest_, now_);
    seen_.push_back({now_, packet.number, packet.begin});
  }

  std::int64_t now_ = 0;
  std::int64_t highest_ = 0;
  std::int64_t offset_ = 0;  ///< of `now_` from the count in the file
  Time latest_ = Time::min();
  std::vector<Seen> seen_;
};

/// What is read of one APID.
class Source {
 public:
  Source(PacketLayout layout, const fs::path& file, std::string name)
      : layout_(std::move(layout)), octets_(layout_.octets()), name_(std::move(name)) {
    table_.file = file;
    table_.name = fmt::format("{}, APID {}", file.filename().string(), layout_.apid);
    table_.stamps.resize(1);
    for (const PacketField& field : layout_.fields) {
      if (field.kind == FieldKind::kFloat) {
        table_.numbers.emplace_back();
      }
    }
  }

  enum class Found { kReport, kDamaged, kOther };

  Found take(const Packet& packet) {
    const std::string_view octets = packet.octets;
    const std::size_t checked = octets.size() - kCrcOctets;
    if (packet_crc(octets.substr(0, checked)) != bits_at(octets, 8 * checked, 8 * kCrcOctets)) {
      if (octets.size() != octets_) {
        refuse(
            packet,
            fmt::format("is of APID {}, has a wrong CRC, and {} octets instead of {}: its length may be damaged, and "
                        "where the next one begins is not certain",
                        layout_.apid, octets.size(), octets_),
            "get the file again, or take this packet out; packets without packet error control are not read");
      }
      sequence_.add_damaged(packet);
      return Found::kDamaged;
    }
    if (checked < header_octets() || !is_selected(octets)) {
      return Found::kOther;
    }
    if (octets.size() != octets_) {
      refuse(packet, fmt::format("is a report of {} octets, and {} would be right", octets.size(), octets_),
             "check that the spacecraft reports what docs/packets.md says");
    }
    read(packet);
    return Found::kReport;
  }

  /// The missing packets of a source that has some; refuses one that has none.
  Defect finish(const std::string& others) {
    if (table_.rows() == 0) {
      throw InputRefused(
          table_.file, {}, fmt::format("has no report of {}, APID {}; it has {}", name_, layout_.apid, others),
          fmt::format(
              "correct apid or gyros in [telemetry.packets]; a report is of service 3, subtype 25, structure {}",
              layout_.fields[header_fields() - 1].value));
    }
    return sequence_.missing(table_.name);
  }
  [[nodiscard]] ForeignTable table() && { return std::move(table_); }
  [[nodiscard]] int apid() const { return layout_.apid; }

 private:
  [[noreturn]] void refuse(const Packet& packet, const std::string& reason, const std::string& cure) const {
    throw InputRefused(table_.file, {}, fmt::format("{} {}", packet.place(), reason), cure);
  }

  [[nodiscard]] bool is_selected(std::string_view octets) const {
    std::size_t bit = 0;
    for (std::size_t i = 0; i < header_fields(); ++i) {
      const PacketField& field = layout_.fields[i];
      if (field.rule == FieldRule::kSelects && bits_at(octets, bit, field.bits) != field.value) {
        return false;
      }
      bit += static_cast<std::size_t>(field.bits);
    }
    return true;
  }

  void read(const Packet& packet) {
    std::size_t bit = 0;
    std::size_t column = 0;
    bool is_valid = true;
    for (const PacketField& field : layout_.fields) {
      const std::uint64_t value = bits_at(packet.octets, bit, field.bits);
      bit += static_cast<std::size_t>(field.bits);
      if (field.rule == FieldRule::kMust && value != field.value) {
        refuse(packet, fmt::format("has {} = {}, which must be {} ({})", field.name, value, field.value, field.about),
               "check that the spacecraft reports what docs/packets.md says");
      }
      switch (field.kind) {
        case FieldKind::kUnsigned:
          break;
        case FieldKind::kTime:
          table_.stamps.front().push_back(time_of_cuc(value));
          break;
        case FieldKind::kFlag:
          is_valid = value != 0;
          break;
        case FieldKind::kFloat:
          table_.numbers[column++].push_back(is_valid ? std::bit_cast<double>(value)
                                                      : std::numeric_limits<double>::quiet_NaN());
          break;
      }
    }
    sequence_.add(bits_at(packet.octets, kSequenceCountBit, 14), table_.stamps.front().back(), packet);
  }

  PacketLayout layout_;
  std::size_t octets_;
  std::string name_;
  ForeignTable table_;
  Sequence sequence_;
};

/// The packet at the front of what is left of a file. Throws InputRefused.
Packet next_packet(std::string_view bytes, std::size_t begin, std::int64_t number, const fs::path& file) {
  constexpr std::size_t kPrimary = kPrimaryHeaderOctets;
  Packet packet{number, begin, bytes.substr(begin)};
  const std::size_t left = packet.octets.size();
  const std::uint64_t version = bits_at(packet.octets, 0, 3);  // one octet is there
  if (version != 0) {
    throw InputRefused(
        file, {},
        fmt::format("{}: no space packet begins here, its version is {} instead of 0", packet.place(), version),
        number == 1 ? "give CCSDS space packets one after the other, without frames or headers of a ground station"
                    : "the packet before may have a damaged length: get the file again, or take that packet out");
  }
  const std::size_t told = left < kPrimary ? kPrimary : kPrimary + 1 + bits_at(packet.octets, kLengthBit, 16);
  if (left < told) {
    throw InputRefused(
        file, {},
        fmt::format("{} is cut short: {} of its {} octets are there", packet.place(), left,
                    left < kPrimary ? "6 or more" : fmt::to_string(told)),
        begin > 0 ? fmt::format("get the file again, or keep its first {} octets", begin) : "get the file again");
  }
  packet.octets = packet.octets.substr(0, told);
  return packet;
}

/// "APID 5, 99", as many as fit into a line.
std::string apids_text(const std::set<int>& apids) {
  constexpr std::size_t kShown = 5;
  std::vector<std::string> texts;
  for (const int apid : apids) {
    if (texts.size() == kShown) {
      texts.emplace_back("…");
      break;
    }
    texts.push_back(fmt::to_string(apid));
  }
  return fmt::format("APID {}", fmt::join(texts, ", "));
}

}  // namespace

PacketTables parse_packets(std::string_view bytes, const fs::path& file, const PacketMap& map,
                           std::size_t star_trackers) {
  std::vector<Source> sources;
  for (PacketLayout& layout : layouts_of(map.apid, map.gyros, star_trackers)) {
    const std::string name =
        sources.empty() ? fmt::format("{} gyros", map.gyros) : fmt::format("star tracker {}", sources.size());
    sources.emplace_back(std::move(layout), file, name);
  }
  PacketTables result;
  Defect damaged;
  damaged.kind = Defect::Kind::kPacketDamaged;
  damaged.where = file.filename().string();
  Defect others;
  others.kind = Defect::Kind::kOtherPackets;
  std::set<int> apids;
  std::int64_t number = 0;
  for (std::size_t begin = 0; begin < bytes.size();) {
    check_stop();
    const Packet packet = next_packet(bytes, begin, ++number, file);
    begin += packet.octets.size();
    const int apid = packet.apid();
    if (apid == kIdleApid) {
      continue;
    }
    const auto source = std::ranges::find(sources, apid, &Source::apid);
    const auto found = source == sources.end() ? Source::Found::kOther : source->take(packet);
    if (found == Source::Found::kDamaged) {
      add_packet(damaged, packet);
    } else if (found == Source::Found::kOther) {
      add_packet(others, packet);
      apids.insert(apid);
    }
  }
  const std::string has =
      number == 0 ? "no packet"
                  : fmt::format("{} packets, {} of them damaged, {} of something else{}", number, damaged.count,
                                others.count, apids.empty() ? "" : " (" + apids_text(apids) + ")");
  others.where = fmt::format("{}, {}", file.filename().string(), apids_text(apids));
  result.defects = {std::move(others), std::move(damaged)};
  for (Source& source : sources) {
    result.defects.push_back(source.finish(has));
    result.tables.push_back(std::move(source).table());
  }
  std::erase_if(result.defects, [](const Defect& defect) { return defect.count == 0; });
  return result;
}

// ---- Writing

namespace {

/// The reports of one source, in order.
class Reports {
 public:
  explicit Reports(PacketLayout layout) : layout_(std::move(layout)) {}

  /// Readings of `size` numbers each.
  void append(std::string& out, Time t, std::span<const double> numbers, std::size_t size) {
    constexpr std::uint64_t kSequenceCounts = 16384;
    constexpr std::uint64_t kMessageCounts = 65536;
    varying_ = {count_ % kSequenceCounts, count_ % kMessageCounts, cuc_of(t)};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i % size == 0) {
        varying_.push_back(
            std::ranges::all_of(numbers.subspan(i, size), [](double value) { return std::isfinite(value); }) ? 1 : 0);
      }
      varying_.push_back(std::bit_cast<std::uint64_t>(numbers[i]));
    }
    append_packet(out, layout_, varying_);
    ++count_;
  }

 private:
  PacketLayout layout_;
  std::uint64_t count_ = 0;
  std::vector<std::uint64_t> varying_;
};

void expect_writable(const Pass& pass, int apid) {
  const int heads = 1 + static_cast<int>(pass.further_star_trackers.size());
  if (apid < 0 || apid + heads > kLastApid) {
    throw UsageError(
        fmt::format("--apid {}: the gyros have this APID and {} star tracker{} the following, 0 to {}; give "
                    "{} at most",
                    apid, heads, heads == 1 ? " has" : "s have", kLastApid, kLastApid - heads));
  }
  const auto holds = [](const std::vector<Time>& times) {
    return std::ranges::all_of(times, [](Time t) { return t >= Time{} && t < kCucEnd; });
  };
  if (!holds(pass.gyro.t) || !holds(pass.star_tracker.t) ||
      !std::ranges::all_of(pass.further_star_trackers, holds, &StarTrackerTelemetry::t)) {
    throw UsageError("--format packets: the time code of 4 octets of seconds ends in 2094, and the pass is later");
  }
}

/// Fixes that have a covariance of their own.
std::size_t fixes_with_covariance(const Pass& pass) {
  const auto told = [](const StarTrackerTelemetry& fixes) {
    return static_cast<std::size_t>(std::ranges::count_if(fixes.covariances, &FixCovariance::is_told));
  };
  std::size_t count = told(pass.star_tracker);
  for (const StarTrackerTelemetry& fixes : pass.further_star_trackers) {
    count += told(fixes);
  }
  return count;
}

}  // namespace

PacketFiles format_packets(const Pass& pass, int apid, const std::string& packets_name, const std::string& prior_name) {
  expect_writable(pass, apid);
  const std::vector<PacketLayout> layouts = layouts_of(apid, pass.gyro.gyros, 1 + pass.further_star_trackers.size());
  PacketFiles files;
  files.xtce = format_xtce(layouts);
  files.covariances_left_out = fixes_with_covariance(pass);
  files.toml = format_pass_toml(pass.settings, pass.settings.prior ? prior_name : "") +
               (files.covariances_left_out == 0
                    ? ""
                    : fmt::format("\n# {} fixes had covariances of their own, which packets do not hold: the noise of "
                                  "all is noise_rad.\n",
                                  files.covariances_left_out)) +
               fmt::format(
                   "\n[telemetry.packets]\nfile = {}\napid = {}  # of the gyros; the star trackers follow\n"
                   "gyros = {}\n",
                   format_text(packets_name), apid, pass.gyro.gyros);
  files.prior = pass.settings.prior ? format_calibration(*pass.settings.prior) : "";

  struct Stream {
    Reports reports;
    const std::vector<Time>& t;
    std::size_t next = 0;
  };
  std::vector<Stream> streams;
  for (const PacketLayout& layout : layouts) {
    const std::size_t i = streams.size();
    streams.push_back({Reports(layout), i == 0   ? pass.gyro.t
                                        : i == 1 ? pass.star_tracker.t
                                                 : pass.further_star_trackers[i - 2].t});
  }
  const auto time_of = [](const Stream& stream) {
    return stream.next < stream.t.size() ? stream.t[stream.next] : Time::max();
  };
  while (true) {
    check_stop();
    const auto stream = std::ranges::min_element(streams, {}, time_of);
    if (stream->next == stream->t.size()) {
      return files;
    }
    const std::size_t row = stream->next++;
    const Time t = stream->t[row];
    if (stream == streams.begin()) {
      const std::size_t width = static_cast<std::size_t>(pass.gyro.gyros) * 3;
      stream->reports.append(files.packets, t, std::span(pass.gyro.h).subspan(row * width, width), 3);
    } else {
      const auto head = stream - streams.begin();
      const Eigen::Quaterniond& q = head == 1
                                        ? pass.star_tracker.q_in_c[row]
                                        : pass.further_star_trackers[static_cast<std::size_t>(head - 2)].q_in_c[row];
      const std::array<double, 4> numbers = {q.x(), q.y(), q.z(), q.w()};
      stream->reports.append(files.packets, t, numbers, numbers.size());
    }
  }
}

}  // namespace trihedron::io
