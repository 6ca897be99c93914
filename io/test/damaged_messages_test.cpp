#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>
#include <sstream>

#include "fixtures.hpp"
#include "oem.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/calibration_message.hpp"

namespace trihedron::io::damaged_messages_test {
namespace {

/// What happens to files: octets changed or lost, lines lost, doubled, exchanged or cut, words of another kind.
class Damage {
 public:
  explicit Damage(unsigned seed) : random_(seed) {}

  std::string of(std::string text) {
    for (std::size_t times = 1 + below(3); times > 0 && !text.empty(); --times) {
      text = once(std::move(text));
    }
    return text;
  }

 private:
  std::size_t below(std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_); }

  std::string once(std::string text) {
    static constexpr std::array<std::string_view, 16> kWords = {"NaN",
                                                                "1e999",
                                                                "-1",
                                                                "=",
                                                                "[deg]",
                                                                "<",
                                                                "</segment>",
                                                                "&x;",
                                                                "2008-12-31T23:59:60",
                                                                "UTC",
                                                                "ITRF",
                                                                "\0",
                                                                "META_STOP",
                                                                "USER_DEFINED_TRIHEDRON_GYROS = 9",
                                                                "\xFF\xFE",
                                                                "COMMENT"};
    switch (below(8)) {
      case 0:
        text[below(text.size())] = static_cast<char>(below(256));
        return text;
      case 1:
        text.erase(below(text.size()), 1 + below(20));
        return text;
      case 2:
        text.resize(below(text.size()));
        return text;
      case 3:
        return text.insert(below(text.size()), kWords.at(below(kWords.size())));
      default:
        break;
    }
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      lines.push_back(line);
    }
    const std::size_t line = below(lines.size());
    switch (below(4)) {
      case 0:
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(line));
        break;
      case 1:
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(below(lines.size())), std::string(lines[line]));
        break;
      case 2:
        std::swap(lines[line], lines[below(lines.size())]);
        break;
      default:
        if (const std::size_t blank = lines[line].find_last_of(" >"); blank != std::string::npos) {
          lines[line] = lines[line].substr(0, blank + 1) + std::string(kWords.at(below(kWords.size())));
        }
    }
    std::string result;
    for (const std::string& one : lines) {
      result += one + "\n";
    }
    return result;
  }

  std::mt19937 random_;
};

std::vector<std::string> whole_messages() {
  const Calibration calibration = sample_calibration();
  MessageDescription description;
  description.created_utc = "2026-01-02T03:04:05";
  AttitudeMessage message;
  for (int i = 0; i < 8; ++i) {
    message.attitude.t.push_back(calibration.epoch + std::chrono::milliseconds(1500 * i));
    message.attitude.q_in_c.emplace_back(0.8, 0.6, 0, 0);
    message.attitude.sigma_rad.emplace_back(1e-5, 2e-5, 3e-5);
    message.rate_rad_s.emplace_back(1e-3, 0, -1e-3);
  }
  std::vector<std::string> whole;
  for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
    whole.push_back(format_aem(message.attitude, message.rate_rad_s, calibration.epoch, description,
                               std::chrono::seconds(10), syntax));
    whole.push_back(format_apm(message, 3, calibration.epoch, description, syntax));
    whole.push_back(
        format_acm(calibration, {&message, nullptr, "none.nc", {}, message.rate_rad_s}, description, syntax));
    whole.push_back(orbit_message(syntax == MessageSyntax::kXml));
  }
  return whole;
}

void read_any(const std::string& text) {
  if (is_orbit_message(text)) {
    static_cast<void>(parse_orbit_message(text, "spoilt", sample_calibration().epoch));
  } else if (is_calibration_message(text)) {
    static_cast<void>(parse_calibration_message(text, "spoilt"));
  } else {
    static_cast<void>(parse_attitude_message(text, "spoilt"));
  }
}

TEST(DamagedMessages, AreReadOrRefusedInALineWithReasonAndCure) {
  constexpr unsigned kEach = 250;
  int refused = 0;
  int read = 0;
  for (const std::string& whole : whole_messages()) {
    EXPECT_EQ(refusal([&] { read_any(whole); }), "");
    for (unsigned seed = 0; seed < kEach; ++seed) {
      const std::string spoilt = Damage(seed).of(whole);
      const std::string said = refusal([&] { read_any(spoilt); });
      if (said.empty()) {
        ++read;
        continue;
      }
      ++refused;
      const bool is_one_line = std::ranges::none_of(said, [](unsigned char c) { return c < ' ' || c == 0x7F; });
      EXPECT_TRUE(is_one_line && said.starts_with("spoilt") && said.find("; ") != std::string::npos)
          << "seed " << seed << ": " << said;
    }
  }
  // Most of it is seen; a digit or a comment that changes is not.
  EXPECT_GT(refused, 2 * read);
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace trihedron::io::damaged_messages_test
