#include "packet_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <iterator>
#include <numeric>
#include <set>

namespace trihedron::io {
namespace {

constexpr std::uint64_t kReportService = 3;
constexpr std::uint64_t kReportSubtype = 25;
constexpr std::uint64_t kFixStructure = 1;
/// Level 1 (TAI, 1958) with 4 octets of seconds and 3 + 1 of the fraction: CCSDS 301.0-B-4, 3.2.2.
constexpr std::uint64_t kCucPreamble = 0x9F04;
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

std::vector<PacketField> header(int apid, std::uint64_t structure) {
  return {
      {"PACKET_VERSION", FieldKind::kUnsigned, 3, FieldRule::kMust, 0, "packet version number"},
      {"PACKET_TYPE", FieldKind::kUnsigned, 1, FieldRule::kMust, 0, "0: telemetry"},
      {"SECONDARY_HEADER_FLAG", FieldKind::kUnsigned, 1, FieldRule::kMust, 1, "1: there is one"},
      {"APID", FieldKind::kUnsigned, 11, FieldRule::kSelects, static_cast<std::uint64_t>(apid),
       "application process: gyros, and a further one for each star tracker"},
      {"SEQUENCE_FLAGS", FieldKind::kUnsigned, 2, FieldRule::kMust, 3, "3: not segmented"},
      {"SEQUENCE_COUNT", FieldKind::kUnsigned, 14, FieldRule::kVaries, 0, "of the APID, modulo 16384"},
      {"PACKET_LENGTH", FieldKind::kUnsigned, 16, FieldRule::kMust, 0, "octets after the primary header, less one"},
      {"PUS_VERSION", FieldKind::kUnsigned, 4, FieldRule::kMust, 2, "2: PUS-C"},
      {"TIME_REFERENCE_STATUS", FieldKind::kUnsigned, 4, FieldRule::kWritten, 0, "not used"},
      {"SERVICE_TYPE", FieldKind::kUnsigned, 8, FieldRule::kSelects, kReportService, "housekeeping"},
      {"MESSAGE_SUBTYPE", FieldKind::kUnsigned, 8, FieldRule::kSelects, kReportSubtype,
       "housekeeping parameter report"},
      {"MESSAGE_TYPE_COUNTER", FieldKind::kUnsigned, 16, FieldRule::kVaries, 0, "of the APID, modulo 65536; not used"},
      {"DESTINATION_ID", FieldKind::kUnsigned, 16, FieldRule::kWritten, 0, "not used"},
      {"CUC_PREAMBLE", FieldKind::kUnsigned, 16, FieldRule::kMust, kCucPreamble,
       "P-field: TAI since 1958, 4 octets of seconds, 4 of the fraction"},
      {"TIME", FieldKind::kTime, 64, FieldRule::kVaries, 0, "of the reading, TAI; raw in units of 2^-32 s since 1958"},
      {"STRUCTURE_ID", FieldKind::kUnsigned, 16, FieldRule::kSelects, structure, "1: a fix; else the number of gyros"},
  };
}

PacketField validity(const std::string& name) {
  return {name + "_VALID", FieldKind::kFlag, 8, FieldRule::kVaries, 0, "0: the reading is not to be used"};
}

void set_length(PacketLayout& layout) {
  const auto length = std::ranges::find(layout.fields, "PACKET_LENGTH", &PacketField::name);
  length->value = layout.octets() - kPrimaryHeaderOctets - 1;
}

void put(std::string& out, unsigned& octet, int& filled, std::uint64_t value, int bits) {
  for (int left = bits; left > 0;) {
    const int taken = std::min(8 - filled, left);
    const auto part = static_cast<unsigned>(value >> static_cast<unsigned>(left - taken)) & ((1U << taken) - 1U);
    octet = (octet << taken) | part;
    left -= taken;
    filled += taken;
    if (filled == 8) {
      out.push_back(static_cast<char>(octet));
      octet = 0;
      filled = 0;
    }
  }
}

// ---- XTCE

std::string type_name(const PacketField& field) {
  switch (field.kind) {
    case FieldKind::kFlag:
      return "VALIDITY";
    case FieldKind::kTime:
      return "CUC_TIME";
    case FieldKind::kFloat:
      return "BINARY64";
    case FieldKind::kUnsigned:
      break;
  }
  return fmt::format("UINT{}", field.bits);
}

std::string type_text(const PacketField& field) {
  const std::string integer = fmt::format("<IntegerDataEncoding sizeInBits=\"{}\" encoding=\"unsigned\"/>", field.bits);
  switch (field.kind) {
    case FieldKind::kFlag:
      return fmt::format(
          "<BooleanParameterType name=\"{}\" zeroStringValue=\"INVALID\" oneStringValue=\"VALID\"><UnitSet/>{}"
          "</BooleanParameterType>",
          type_name(field), integer);
    case FieldKind::kTime:
      return fmt::format(
          "<AbsoluteTimeParameterType name=\"{}\"><Encoding units=\"seconds\" scale=\"2.3283064365386962890625E-10\">"
          "{}</Encoding><ReferenceTime><Epoch>TAI</Epoch></ReferenceTime></AbsoluteTimeParameterType>",
          type_name(field), integer);
    case FieldKind::kFloat:
      return fmt::format(
          "<FloatParameterType name=\"{}\" sizeInBits=\"64\"><UnitSet/><FloatDataEncoding sizeInBits=\"{}\" "
          "encoding=\"IEEE754_1985\"/></FloatParameterType>",
          type_name(field), field.bits);
    case FieldKind::kUnsigned:
      break;
  }
  return fmt::format(
      "<IntegerParameterType name=\"{}\" signed=\"false\" sizeInBits=\"{}\"><UnitSet/>{}</IntegerParameterType>",
      type_name(field), field.bits, integer);
}

PacketField crc_field() {
  return {"CRC",
          FieldKind::kUnsigned,
          16,
          FieldRule::kVaries,
          0,
          "packet error control: CRC-16-CCITT of all octets before it, polynomial 1021, begins with FFFF "
          "(hexadecimal)"};
}

std::string entry(const PacketField& field) {
  return fmt::format("          <ParameterRefEntry parameterRef=\"{}\"/>\n", field.name);
}

}  // namespace

std::size_t PacketLayout::octets() const {
  const int bits = std::accumulate(fields.begin(), fields.end(), 0,
                                   [](int sum, const PacketField& field) { return sum + field.bits; });
  return static_cast<std::size_t>(bits) / 8 + kCrcOctets;
}

std::size_t header_fields() {
  static const std::size_t count = header(0, 0).size();
  return count;
}

std::size_t header_octets() {
  static const std::size_t octets = PacketLayout{"", 0, header(0, 0)}.octets() - kCrcOctets;
  return octets;
}

PacketLayout gyro_layout(int apid, int gyros) {
  PacketLayout layout{"GYRO_REPORT", apid, header(apid, static_cast<std::uint64_t>(gyros))};
  for (int gyro = 1; gyro <= gyros; ++gyro) {
    layout.fields.push_back(validity(fmt::format("H{}", gyro)));
    for (const char axis : {'X', 'Y', 'Z'}) {
      layout.fields.push_back({fmt::format("H{}_{}", gyro, axis), FieldKind::kFloat, 64, FieldRule::kVaries, 0,
                               fmt::format("direction cosine {} of the angular momentum of gyro {} in its case axes",
                                           static_cast<char>(axis - 'X' + 'x'), gyro)});
    }
  }
  set_length(layout);
  return layout;
}

PacketLayout star_tracker_layout(int apid, int number) {
  PacketLayout layout{fmt::format("STAR_TRACKER_{}_REPORT", number), apid, header(apid, kFixStructure)};
  const std::string name = fmt::format("ST{}_Q", number);
  layout.fields.push_back(validity(name));
  for (const char axis : {'X', 'Y', 'Z', 'W'}) {
    layout.fields.push_back({fmt::format("{}_{}", name, axis), FieldKind::kFloat, 64, FieldRule::kVaries, 0,
                             fmt::format("attitude quaternion of star tracker {} from its axes to inertial axes, {} "
                                         "component (Hamilton, w is the scalar)",
                                         number, axis == 'W' ? 'w' : static_cast<char>(axis - 'X' + 'x'))});
  }
  set_length(layout);
  return layout;
}

std::vector<PacketLayout> layouts_of(int apid, int gyros, std::size_t star_trackers) {
  std::vector<PacketLayout> layouts = {gyro_layout(apid, gyros)};
  for (int number = 1; number <= static_cast<int>(star_trackers); ++number) {
    layouts.push_back(star_tracker_layout(apid + number, number));
  }
  return layouts;
}

std::uint64_t bits_at(std::string_view octets, std::size_t bit, int bits) {
  const std::size_t end = bit + static_cast<std::size_t>(bits);
  std::uint64_t value = 0;
  for (std::size_t i = bit / 8; i < (end + 7) / 8; ++i) {
    value = (value << 8U) | static_cast<unsigned char>(octets[i]);
  }
  value >>= (8 - end % 8) % 8;
  return bits == 64 ? value : value & ((std::uint64_t{1} << static_cast<unsigned>(bits)) - 1);
}

std::uint16_t packet_crc(std::string_view octets) {
  boost::crc_optimal<16, 0x1021, 0xFFFF, 0, false, false> crc;
  crc.process_bytes(octets.data(), octets.size());
  return static_cast<std::uint16_t>(crc.checksum());
}

std::uint64_t cuc_of(Time t) {
  const auto ns = static_cast<std::uint64_t>(t.time_since_epoch().count());
  const std::uint64_t fraction = ns % kNanosecondsPerSecond;  // below 2^30
  const std::uint64_t units = ((fraction << 32U) + kNanosecondsPerSecond / 2) / kNanosecondsPerSecond;
  return ((ns / kNanosecondsPerSecond) << 32U) + units;
}

Time time_of_cuc(std::uint64_t cuc) {
  const std::uint64_t fraction = cuc & 0xFFFF'FFFFU;
  const std::uint64_t ns = (fraction * kNanosecondsPerSecond + (std::uint64_t{1} << 31U)) >> 32U;
  return Time(Duration(static_cast<std::int64_t>((cuc >> 32U) * kNanosecondsPerSecond + ns)));
}

void append_packet(std::string& out, const PacketLayout& layout, const std::vector<std::uint64_t>& varying) {
  const std::size_t begin = out.size();
  unsigned octet = 0;
  int filled = 0;
  auto value = varying.begin();
  for (const PacketField& field : layout.fields) {
    put(out, octet, filled, field.rule == FieldRule::kVaries ? *value++ : field.value, field.bits);
  }
  put(out, octet, filled, packet_crc(std::string_view(out).substr(begin)), kCrcOctets * 8);
}

std::string format_xtce(const std::vector<PacketLayout>& layouts) {
  const PacketField crc = crc_field();
  const auto headers = static_cast<std::ptrdiff_t>(header_fields());
  const std::vector<PacketField>& first = layouts.front().fields;
  std::vector<PacketField> parameters(first.begin(), first.begin() + headers);
  for (const PacketLayout& layout : layouts) {
    parameters.insert(parameters.end(), layout.fields.begin() + headers, layout.fields.end());
  }
  parameters.push_back(crc);

  std::set<std::string> types;
  std::string type_set;
  std::string parameter_set;
  for (const PacketField& field : parameters) {
    if (types.insert(type_name(field)).second) {
      type_set += fmt::format("      {}\n", type_text(field));
    }
    parameter_set += fmt::format("      <Parameter name=\"{}\" parameterTypeRef=\"{}\" shortDescription=\"{}\"/>\n",
                                 field.name, type_name(field), field.about);
  }

  std::string containers =
      "      <SequenceContainer name=\"CCSDSPacket\" abstract=\"true\" shortDescription=\"primary header, PUS-C "
      "secondary header, structure ID\">\n        <EntryList>\n";
  for (auto field = first.begin(); field != first.begin() + headers; ++field) {
    containers += entry(*field);
  }
  containers += "        </EntryList>\n      </SequenceContainer>\n";
  for (const PacketLayout& layout : layouts) {
    containers += fmt::format("      <SequenceContainer name=\"{}\">\n        <EntryList>\n", layout.name);
    for (auto field = layout.fields.begin() + headers; field != layout.fields.end(); ++field) {
      containers += entry(*field);
    }
    containers += entry(crc) +
                  "        </EntryList>\n        <BaseContainer containerRef=\"CCSDSPacket\">\n"
                  "          <RestrictionCriteria>\n            <ComparisonList>\n";
    for (const PacketField& field : layout.fields) {
      if (field.rule == FieldRule::kSelects) {
        containers +=
            fmt::format("              <Comparison parameterRef=\"{}\" value=\"{}\" useCalibratedValue=\"false\"/>\n",
                        field.name, field.value);
      }
    }
    containers +=
        "            </ComparisonList>\n          </RestrictionCriteria>\n        </BaseContainer>\n"
        "      </SequenceContainer>\n";
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<SpaceSystem name=\"trihedron\" shortDescription=\"Telemetry of electrostatic gyros and star trackers\"\n"
      "    xmlns=\"http://www.omg.org/spec/XTCE/20180204\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"\n"
      "    xsi:schemaLocation=\"http://www.omg.org/spec/XTCE/20180204 "
      "https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd\">\n"
      "  <TelemetryMetaData>\n    <ParameterTypeSet>\n{}    </ParameterTypeSet>\n    <ParameterSet>\n{}"
      "    </ParameterSet>\n    <ContainerSet>\n{}    </ContainerSet>\n  </TelemetryMetaData>\n</SpaceSystem>\n",
      type_set, parameter_set, containers);
}

}  // namespace trihedron::io
