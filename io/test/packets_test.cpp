#include "packets.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "fixtures.hpp"
#include "packet_layout.hpp"
#include "trihedron/io/packets.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using DefectKind = Defect::Kind;

/// clean_pass() in memory.
Pass plain_pass() {
  const TemporaryDirectory directory;
  clean_pass().save_directory(directory / "pass");
  return read_pass(directory / "pass").pass;
}

/// The packets of a file by themselves.
std::vector<std::string> split(std::string_view bytes) {
  std::vector<std::string> packets;
  while (!bytes.empty()) {
    const std::size_t size = 7 + bits_at(bytes, kLengthBit, 16);
    packets.emplace_back(bytes.substr(0, size));
    bytes.remove_prefix(size);
  }
  return packets;
}

std::string joined(const std::vector<std::string>& packets) {
  std::string bytes;
  for (const std::string& packet : packets) {
    bytes += packet;
  }
  return bytes;
}

int apid_of(const std::string& packet) { return static_cast<int>(bits_at(packet, kApidBit, 11)); }

/// With a CRC that fits what was changed.
std::string sealed(std::string packet) {
  const std::uint16_t crc = packet_crc(std::string_view(packet).substr(0, packet.size() - kCrcOctets));
  packet[packet.size() - 2] = static_cast<char>(crc >> 8U);
  packet[packet.size() - 1] = static_cast<char>(crc & 0xFFU);
  return packet;
}

std::string with_octet(std::string packet, std::size_t at, int value) {
  packet[at] = static_cast<char>(value);
  return packet;
}

std::string with_count(std::string packet, int count) {
  packet[2] = static_cast<char>(0xC0 | (count >> 8));
  packet[3] = static_cast<char>(count & 0xFF);
  return sealed(packet);
}

/// A packet of another process: 20 octets, without secondary header.
std::string foreign(int apid) {
  std::string packet(20, 'x');
  packet.replace(0, 6, std::string("\0\0\xC0\0\0\x0D", 6));
  packet[0] = static_cast<char>(apid >> 8);
  packet[1] = static_cast<char>(apid & 0xFF);
  return packet;
}

/// TM[17,2], "are you alive": a secondary header without source data, 25 octets, which ends before a structure ID.
std::string short_report(int apid) {
  std::string packet(25, '\0');
  packet.replace(0, 9, std::string("\x08\0\xC0\0\0\x12\x20\x11\x02", 9));
  packet[1] = static_cast<char>(apid);
  packet.replace(13, 2, "\x9F\x04");
  return sealed(packet);
}

const std::string& clean_bytes() {
  static const std::string bytes = format_packets(plain_pass(), kDefaultApid, "p", "").packets;
  return bytes;
}

PacketTables parsed(std::string_view bytes) { return parse_packets(bytes, "p.ccsds", {"p.ccsds"}, 1); }

std::map<DefectKind, std::int64_t> counts(const PacketTables& tables) {
  std::map<DefectKind, std::int64_t> result;
  for (const Defect& defect : tables.defects) {
    result[defect.kind] += defect.count;
  }
  return result;
}

Pass read_back(const PacketFiles& files, const char* prior_name = "prior.json") {
  const TemporaryDirectory directory;
  write_text(directory / "p.ccsds", files.packets);
  write_text(directory / "p.toml", files.toml);
  write_text(directory / prior_name, files.prior);
  return read_pass(directory / "p.toml").pass;
}

TEST(Packets, BringBackEveryNumberAndTime) {
  Pass pass = plain_pass();
  const Pass plain = pass;
  pass.gyro.gyros = 3;
  pass.settings.gyros.push_back(pass.settings.gyros.back());
  pass.gyro.h.clear();
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    pass.gyro.t[i] += Duration(static_cast<std::int64_t>(i * 7919));  // whole nanoseconds, nothing rounder
    const Eigen::Vector3d first = plain.gyro.direction(i, 0);
    for (const Eigen::Vector3d& direction : {first, plain.gyro.direction(i, 1), Eigen::Vector3d(-first)}) {
      const Eigen::Vector3d h = direction / 3.0;
      pass.gyro.h.insert(pass.gyro.h.end(), {3 * h.x(), 3 * h.y(), 3 * h.z()});
    }
  }
  pass.gyro.h[5] = std::numeric_limits<double>::infinity();
  pass.star_tracker.q_in_c[2].w() = kNaN;
  pass.settings.further_star_trackers.push_back({{1e-5, 2e-5, 3e-5}, {0, 1, 0}, 1e-3});
  pass.further_star_trackers.push_back(plain.star_tracker);
  for (Time& t : pass.further_star_trackers.front().t) {
    t += std::chrono::milliseconds(1500);
  }
  pass.further_star_trackers.front().t.pop_back();
  pass.further_star_trackers.front().q_in_c.pop_back();
  const PacketFiles files = format_packets(pass, 7, "p.ccsds", "prior.json");
  const Pass back = read_back(files);
  // A reading that is not finite is not valid, and none of its components is told.
  for (std::size_t i = 3; i < 6; ++i) {
    pass.gyro.h[i] = kNaN;
  }
  pass.star_tracker.q_in_c[2].coeffs().setConstant(kNaN);
  expect_same_pass(pass, back, 0, 0);
  EXPECT_EQ(back.gyro.t, pass.gyro.t);
  EXPECT_EQ(back.further_star_trackers.front().t, pass.further_star_trackers.front().t);
  EXPECT_EQ(back.settings.further_star_trackers.front().noise_rad, Eigen::Vector3d(1e-5, 2e-5, 3e-5));
  EXPECT_TRUE(format_packets(back, 7, "p.ccsds", "prior.json").packets ==
              format_packets(pass, 7, "p.ccsds", "prior.json").packets);
}

TEST(Packets, BringBackThePriorCalibration) {
  Pass pass = plain_pass();
  pass.settings.prior = sample_calibration();
  for (const char* const name : {"prior.json", "the \"first\" \\ 'best'.json"}) {
    const PacketFiles files = format_packets(pass, kDefaultApid, "p.ccsds", name);
    EXPECT_NE(files.toml.find("prior = \""), std::string::npos);
    const Pass back = read_back(files, name);
    ASSERT_TRUE(back.settings.prior);
    EXPECT_EQ(back.settings.prior->covariance, pass.settings.prior->covariance);
  }
}

TEST(Packets, SayThatTheyHoldNoCovariancesOfFixes) {
  Pass pass = plain_pass();
  EXPECT_EQ(format_packets(pass, kDefaultApid, "p", "").covariances_left_out, 0U);
  EXPECT_EQ(format_packets(pass, kDefaultApid, "p", "").toml.find("covariances"), std::string::npos);
  pass.star_tracker.covariances.assign(pass.star_tracker.size(), {{1e-10, 2e-10, 3e-10, 0, 0, 0}});
  pass.star_tracker.covariances[3] = {};  // one that tells none
  const PacketFiles files = format_packets(pass, kDefaultApid, "p.ccsds", "");
  EXPECT_EQ(files.covariances_left_out, pass.star_tracker.size() - 1);
  EXPECT_NE(files.toml.find(fmt::format("# {} fixes had covariances of their own", pass.star_tracker.size() - 1)),
            std::string::npos);
  EXPECT_TRUE(read_back(files).star_tracker.covariances.empty());
}

TEST(Packets, HaveTheOctetsOfTheStandards) {
  // CRC-16-CCITT of "123456789" (ECSS-E-ST-70-41C, annex B, by the usual check value).
  EXPECT_EQ(packet_crc("123456789"), 0x29B1);
  Pass pass = plain_pass();
  pass.settings.epoch = Time(std::chrono::seconds(0x60A5A680));
  pass.gyro.t.assign(1, pass.settings.epoch + std::chrono::milliseconds(500));
  pass.gyro.h = {1, 0, 0, 0, -2, 0};
  pass.star_tracker.t.assign(1, pass.settings.epoch);
  pass.star_tracker.q_in_c.assign(1, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5));
  std::string octets;
  for (const char c : format_packets(pass, 100, "p", "").packets) {
    octets += fmt::format("{:02x}", static_cast<unsigned char>(c));
  }
  const std::string fix =
      "0865c0000035"                                                       // primary header: telemetry, APID 101, first
      "20031900000000"                                                     // PUS-C, 3/25, counter 0, destination 0
      "9f0460a5a68000000000"                                               // CUC with its P-field
      "000101"                                                             // structure 1, valid
      "bfe00000000000003fe00000000000003fe00000000000003fe0000000000000";  // x, y, z, w
  const std::string sample =
      "0864c0000046"
      "20031900000000"
      "9f0460a5a68080000000"
      "000201"
      "3ff000000000000000000000000000000000000000000000"
      "01"
      "0000000000000000c0000000000000000000000000000000";
  ASSERT_EQ(octets.size(), fix.size() + sample.size() + 8);
  EXPECT_EQ(octets.substr(0, fix.size()), fix);
  EXPECT_EQ(octets.substr(fix.size() + 4, sample.size()), sample);
}

TEST(Packets, HoldTimeToTheNanosecond) {
  for (std::int64_t i = 0; i < 10000; ++i) {
    const Time t{Duration(i * 429'496'729'599'993)};  // as far as the code goes, with any nanosecond
    ASSERT_EQ(time_of_cuc(cuc_of(t)), t);
  }
  for (const std::int64_t ns : {0L, 1L, 499'999'999L, 500'000'000L, 999'999'999L, 1'000'000'000L}) {
    EXPECT_EQ(time_of_cuc(cuc_of(Time(Duration(ns)))).time_since_epoch().count(), ns);
  }
  EXPECT_EQ(cuc_of(kCucEnd - Duration(1)) >> 32U, 0xFFFF'FFFFU);
  EXPECT_EQ(time_of_cuc(std::numeric_limits<std::uint64_t>::max()), kCucEnd);
}

TEST(Packets, AreNotWrittenWhereTheyCannotHoldThePass) {
  Pass pass = plain_pass();
  EXPECT_THROW(static_cast<void>(format_packets(pass, -1, "p", "")), UsageError);
  EXPECT_THROW(static_cast<void>(format_packets(pass, kLastApid, "p", "")), UsageError);
  EXPECT_NO_THROW(static_cast<void>(format_packets(pass, kLastApid - 1, "p", "")));
  pass.star_tracker.t.back() = kCucEnd;
  EXPECT_THROW(static_cast<void>(format_packets(pass, kDefaultApid, "p", "")), UsageError);
}

TEST(Packets, OfOtherProcessesAreSkippedAndCountedIdleOnesOnlySkipped) {
  std::vector<std::string> packets = split(clean_bytes());
  packets.insert(packets.begin() + 1, {foreign(5), foreign(kIdleApid), foreign(99)});
  packets.push_back(foreign(5));
  packets.push_back(sealed(with_octet(packets.front(), 7, 5)));  // an event report of the gyros
  packets.push_back(short_report(kDefaultApid));
  packets.push_back(short_report(kDefaultApid + 1));
  const PacketTables tables = parsed(joined(packets));
  EXPECT_EQ(counts(tables), (std::map<DefectKind, std::int64_t>{{DefectKind::kOtherPackets, 6}}));
  EXPECT_EQ(tables.defects.front().where, "p.ccsds, APID 5, 99, 100, 101");
  EXPECT_EQ(tables.defects.front().first.front().packet, 2);
  const PacketTables plain = parsed(clean_bytes());
  EXPECT_EQ(tables.tables[0].numbers, plain.tables[0].numbers);
  EXPECT_EQ(tables.tables[1].stamps, plain.tables[1].stamps);
}

TEST(Packets, WithAWrongCrcAreLeftOutAndCountedOnce) {
  std::vector<std::string> packets = split(clean_bytes());
  const std::size_t octet = packets[0].size() + packets[1].size();
  packets[2][40] = static_cast<char>(packets[2][40] ^ 1);
  const PacketTables tables = parsed(joined(packets));
  EXPECT_EQ(counts(tables), (std::map<DefectKind, std::int64_t>{{DefectKind::kPacketDamaged, 1}}));
  EXPECT_EQ(tables.defects.front().text(), fmt::format("p.ccsds: 1 packet whose CRC is wrong, left out: packet 3 at "
                                                       "octet {}.",
                                                       octet));
  EXPECT_EQ(tables.tables[0].rows() + tables.tables[1].rows(), packets.size() - 1);
}

/// The gyros' packets, one after the other, and a fix.
struct Counted {
  std::vector<std::string> gyros;
  std::string fix;

  Counted() {
    for (const std::string& packet : split(clean_bytes())) {
      (apid_of(packet) == kDefaultApid ? gyros.emplace_back() : fix) = packet;
    }
    fix = with_count(fix, 0);
  }
  [[nodiscard]] std::int64_t missing() const {
    const auto found = counts(parsed(joined(gyros) + fix));
    return found.contains(DefectKind::kPacketsMissing) ? found.at(DefectKind::kPacketsMissing) : 0;
  }
};

TEST(Packets, ThatAreMissingAreCountedByTheSequenceCount) {
  Counted file;
  file.gyros.erase(file.gyros.begin() + 10, file.gyros.begin() + 14);
  file.gyros.erase(file.gyros.begin() + 20);
  EXPECT_EQ(file.missing(), 5);
  const PacketTables tables = parsed(joined(file.gyros) + file.fix);
  ASSERT_EQ(tables.defects.size(), 1U);
  EXPECT_EQ(tables.defects.front().where, "p.ccsds, APID 100");
  ASSERT_EQ(tables.defects.front().first.size(), 2U);
  EXPECT_EQ(tables.defects.front().first[0].packet, 11);
  EXPECT_EQ(tables.defects.front().first[1].packet, 21);
}

TEST(Packets, TheSequenceCountGoesOnAtZeroAfter16383) {
  Counted file;
  for (std::size_t i = 0; i < file.gyros.size(); ++i) {
    file.gyros[i] = with_count(file.gyros[i], static_cast<int>((16300 + i) % 16384));
  }
  EXPECT_EQ(file.missing(), 0);
  file.gyros.erase(file.gyros.begin() + 82, file.gyros.begin() + 90);  // across the end
  EXPECT_EQ(file.missing(), 8);
}

TEST(Packets, ThatCrossOrAreThereTwiceAreNotMissing) {
  Counted file;
  std::swap(file.gyros[3], file.gyros[6]);
  file.gyros.insert(file.gyros.begin() + 20, file.gyros[12]);
  EXPECT_EQ(file.missing(), 0);
}

TEST(Packets, ASequenceCountThatBeginsAnewIsNoLoss) {
  Counted file;
  for (std::size_t i = 50; i < file.gyros.size(); ++i) {
    file.gyros[i] = with_count(file.gyros[i], static_cast<int>(i - 50));
  }
  EXPECT_EQ(file.missing(), 0);
  file.gyros.erase(file.gyros.begin() + 60);
  EXPECT_EQ(file.missing(), 1);
}

TEST(Packets, RepeatedAndOutOfOrderAreScreenedAsInAnyPass) {
  Pass pass = plain_pass();
  PacketFiles files = format_packets(pass, kDefaultApid, "p.ccsds", "");
  Counted file;
  std::swap(file.gyros[3], file.gyros[4]);
  file.gyros.push_back(file.gyros.back());
  const TemporaryDirectory directory;
  write_text(directory / "p.ccsds", joined(file.gyros) + file.fix);
  write_text(directory / "p.toml", files.toml);
  const LoadedPass loaded = read_pass(directory / "p.toml");
  EXPECT_EQ(only(loaded.defects, DefectKind::kBackwardTime).count, 1);
  EXPECT_EQ(only(loaded.defects, DefectKind::kRepeatedTime).count, 1);
}

TEST(Packets, WhatIsReportedInvalidIsMissing) {
  std::vector<std::string> packets = split(clean_bytes());
  constexpr std::size_t kFirstValidity = 25;
  const std::size_t gyro = apid_of(packets[0]) == kDefaultApid ? 0 : 1;
  packets[gyro] = sealed(with_octet(packets[gyro], kFirstValidity, 0));
  const ForeignTable table = parsed(joined(packets)).tables[0];
  EXPECT_TRUE(std::isnan(table.numbers[0][0]) && std::isnan(table.numbers[2][0]));
  EXPECT_TRUE(std::isfinite(table.numbers[3][0]) && std::isfinite(table.numbers[0][1]));
}

TEST(Packets, OfWhatCannotBeUnderstoodAreRefusedWithPlaceReasonAndCure) {
  const std::vector<std::string> packets = split(clean_bytes());
  const std::size_t size = packets[0].size();
  const auto refused = [](const std::string& bytes) { return refusal([&] { static_cast<void>(parsed(bytes)); }); };
  const auto second = [&](const std::string& packet) {
    std::vector<std::string> changed = packets;
    changed[1] = packet;
    return refused(joined(changed));
  };
  const std::string place = fmt::format("p.ccsds: packet 2, at octet {}", size);
  const std::string& clean = packets[1];
  const auto expect = [](const std::string& text, const std::string& begin, const std::string& rest) {
    EXPECT_TRUE(text.starts_with(begin)) << text;
    EXPECT_NE(text.find(rest), std::string::npos) << text;
    EXPECT_NE(text.find("; "), std::string::npos) << text;
  };
  expect(refused(""), "p.ccsds: ", "has no report of 2 gyros, APID 100; it has no packet");
  expect(refused("PK\3\4 something"), "p.ccsds: packet 1, at octet 0", "its version is 2");
  expect(refused(clean_bytes().substr(0, size + 3)), place, "is cut short: 3 of its 6 or more octets");
  expect(refused(clean_bytes().substr(0, size + 30)), place, fmt::format("keep its first {} octets", size));
  expect(second(with_octet(clean, 0, 0x28)), place, "no space packet begins here, its version is 1");
  expect(second(with_octet(clean, 5, clean[5] + 8)), place, "its length may be damaged");
  expect(second(sealed(with_octet(clean, 6, 0x10))), place, "PUS_VERSION = 1, which must be 2");
  expect(second(sealed(with_octet(clean, 13, 0x2F))), place, "CUC_PREAMBLE");
  expect(second(sealed(with_octet(clean, 0, clean[0] | 0x10))), place, "PACKET_TYPE = 1");
  expect(second(sealed(with_octet(clean, 2, 0x40))), place, "SEQUENCE_FLAGS = 1");
  expect(second(sealed(with_octet(clean, 5, clean[5] - 1).substr(0, clean.size() - 1))), place,
         fmt::format("is a report of {} octets", clean.size() - 1));
  expect(second(with_octet(clean, 5, 4).substr(0, 11)), place, "has a wrong CRC, and 11 octets");
  std::vector<std::string> gyros;
  std::ranges::copy_if(packets, std::back_inserter(gyros),
                       [](const std::string& packet) { return apid_of(packet) == kDefaultApid; });
  expect(refused(joined(gyros)), "p.ccsds: ", "no report of star tracker 1, APID 101");
  expect(refusal([&] {
           static_cast<void>(parse_packets(clean_bytes(), "p.ccsds", {"p.ccsds", 100, 3}, 1));
         }),
         "p.ccsds: ", "no report of 3 gyros, APID 100");
}

/// What is damaged never gives a number that was not sent: it is refused, or what is left out is counted.
TEST(Packets, DamagedAtRandomAreRefusedOrLeftOutAndCounted) {
  const PacketTables clean = parsed(clean_bytes());
  const auto row_of = [](const ForeignTable& table, std::size_t row) {
    std::vector<double> values;
    for (const std::vector<double>& column : table.numbers) {
      values.push_back(column[row]);
    }
    return values;
  };
  std::array<std::map<Time, std::vector<double>>, 2> sent;
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t row = 0; row < clean.tables[k].rows(); ++row) {
      sent[k][clean.tables[k].stamps[0][row]] = row_of(clean.tables[k], row);
    }
  }
  int refused = 0;
  int counted = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    std::mt19937 generator(seed);
    const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(generator); };
    std::string bytes = clean_bytes();
    const std::size_t at = below(bytes.size());
    switch (seed % 6) {
      case 0:  // a bit, or two next to each other
        bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>((1U + 2U * below(2)) << below(7)));
        break;
      case 1:
        bytes[at] = static_cast<char>(bytes[at] + 1 + static_cast<char>(below(254)));
        break;
      case 2:  // an end that is missing
        bytes.resize(at);
        break;
      case 3:
        bytes.erase(at, 1 + below(100));
        break;
      case 4:
        bytes.insert(at, std::string(1 + below(100), static_cast<char>(below(256))));
        break;
      default:  // in a header
        std::vector<std::string> packets = split(bytes);
        std::string& packet = packets[below(packets.size())];
        const std::size_t octet = below(6);
        packet[octet] = static_cast<char>(packet[octet] ^ static_cast<char>(1U << below(8)));
        bytes = joined(packets);
    }
    try {
      const PacketTables tables = parsed(bytes);
      std::size_t rows = 0;
      for (std::size_t k = 0; k < 2; ++k) {
        rows += tables.tables[k].rows();
        for (std::size_t row = 0; row < tables.tables[k].rows(); ++row) {
          ASSERT_EQ(sent[k].at(tables.tables[k].stamps[0][row]), row_of(tables.tables[k], row)) << "seed " << seed;
        }
      }
      // An end that falls between two packets, and the ends of a table, cannot be told.
      const bool is_whole = rows == sent[0].size() + sent[1].size();
      const bool may_be_silent = seed % 6 == 2 || is_whole || rows + 1 == sent[0].size() + sent[1].size();
      ASSERT_TRUE(!tables.defects.empty() || may_be_silent) << "seed " << seed;
      ++counted;
    } catch (const InputRefused& error) {
      ASSERT_FALSE(error.reason().empty() || error.cure().empty()) << "seed " << seed;
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
  EXPECT_GT(counted, 100);
}

TEST(Packets, TheTelemetryTomlOfPacketsHasNoTables) {
  PacketFiles files = format_packets(plain_pass(), kDefaultApid, "p.ccsds", "");
  const auto refused = [&](const std::string& toml) {
    files.toml = toml;
    return refusal([&] { static_cast<void>(read_back(files)); });
  };
  const std::string toml = files.toml;
  EXPECT_EQ(refused(toml), "");
  EXPECT_EQ(refused(toml + "\n[telemetry.time]\nscale = \"GPS\"\nformat = \"iso\"\n[telemetry]\nfrom = "
                           "\"2009-05-20T00:00:00\"\n"),
            "");
  EXPECT_NE(refused(toml + "\n[telemetry.gyro]\n").find("\"gyro\" is not known"), std::string::npos);
  EXPECT_NE(refused(replaced(toml, "apid = 100", "apid = 2047")).find("outside 0 to 2046"), std::string::npos);
  EXPECT_NE(refused(replaced(toml, "apid = 100", "apid = 2046")).find("leaves no room"), std::string::npos);
  EXPECT_NE(refused(replaced(toml, "gyros = 2", "gyros = 5")).find("outside 2 to 4"), std::string::npos);
  EXPECT_NE(refused(replaced(toml, "file = ", "files = ")).find("\"files\" is not known"), std::string::npos);
}

}  // namespace
}  // namespace trihedron::io
