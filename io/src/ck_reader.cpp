#include "ck_reader.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "attitude_rules.hpp"
#include "ndm_places.hpp"
#include "text_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_scale.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace ck {
namespace {

namespace fs = std::filesystem;

constexpr double kMostTicks = 9007199254740992;  // 2⁵³: what a double counts
constexpr double kMostSeconds = 6.4e9;           // years 1958 to 2200

// ---- The text kernel of a clock: NAIF's kernel.req and sclk.req

/// Lists of numbers by their names; texts and dates are read over.
using Pool = std::map<std::string, std::vector<double>, std::less<>>;

class ClockKernel {
 public:
  ClockKernel(std::string_view text, const fs::path& file) : text_(text), file_(file) {}

  [[nodiscard]] Pool read() {
    if (!text_.starts_with("KPL/")) {
      refuse({1, 1}, "does not begin with KPL/", "give the text kernel of the clock (SCLK)");
    }
    NdmLines lines(text_);
    bool is_data = false;
    while (const auto line = lines.next()) {
      const std::string_view words = trimmed(*line);
      if (words == "\\begindata" || words == "\\begintext") {
        is_data = words == "\\begindata";
      } else if (is_data) {
        take(words, lines.at(words));
      }
    }
    if (is_list_) {
      refuse(lines.here(), "the file ends within a list", "write it again, as a whole");
    }
    return std::move(pool_);
  }

 private:
  [[noreturn]] void refuse(Position at, std::string reason, std::string cure) const {
    throw InputRefused(file_, at, std::move(reason), std::move(cure));
  }

  void take(std::string_view words, Position at) {
    if (!is_list_) {
      const std::size_t equals = words.find('=');
      if (equals == std::string_view::npos || equals == 0) {
        refuse(at, fmt::format("{} is no assignment", in_quotes(words)), "write NAME = ( values )");
      }
      const bool adds = words[equals - 1] == '+';
      values_ = &pool_[std::string(trimmed(words.substr(0, equals - (adds ? 1 : 0))))];
      if (!adds) {
        values_->clear();
      }
      words = trimmed(words.substr(equals + 1));
      is_list_ = words.starts_with('(');
      words.remove_prefix(is_list_ ? 1 : 0);
    }
    while (!words.empty()) {
      const std::size_t begin = words.find_first_not_of(" \t,");
      if (begin == std::string_view::npos) {
        return;
      }
      words.remove_prefix(begin);
      if (words.front() == ')') {
        is_list_ = false;
        return;
      }
      const bool quoted = words.front() == '\'';
      const std::size_t end = quoted ? words.find('\'', 1) : words.find_first_of(" \t,)");
      if (!quoted && words.front() != '@') {
        values_->push_back(number(words.substr(0, end), at));
      }
      words.remove_prefix(std::min(quoted && end != std::string_view::npos ? end + 1 : end, words.size()));
    }
  }

  [[nodiscard]] double number(std::string_view word, Position at) const {
    std::string digits(word);
    std::ranges::replace_if(
        digits, [](char c) { return c == 'D' || c == 'd'; }, 'E');
    const char* const first = digits.data() + (digits.starts_with('+') ? 1 : 0);
    const char* const last = digits.data() + digits.size();
    double value = 0;
    const auto [end, fault] = fast_float::from_chars(first, last, value);
    if (fault != std::errc() || end != last || !std::isfinite(value)) {
      refuse(at, fmt::format("{} is not a number", in_quotes(word)), "repair the kernel");
    }
    return value;
  }

  std::string_view text_;
  const fs::path& file_;
  Pool pool_;
  std::vector<double>* values_ = nullptr;
  bool is_list_ = false;
};

/// From encoded ticks to time.
class Clock {
 public:
  /// `number`: of the clock, without its sign.
  Clock(Pool pool, std::int64_t number, const fs::path& file) : file_(file) {
    const auto values = [&](std::string_view name) -> const std::vector<double>& {
      const std::string key = fmt::format("{}_{}", name, number);
      const auto found = pool.find(key);
      if (found == pool.end() || found->second.empty()) {
        refuse(fmt::format("has no {}", key), "give the kernel of the clock of this attitude");
      }
      return found->second;
    };
    if (values("SCLK_DATA_TYPE").front() != 1) {
      refuse("is of a clock of another type than 1", "give an SCLK kernel of type 1");
    }
    double system = 1;  // TDB, where none is told
    if (const auto told = pool.find(fmt::format("SCLK01_TIME_SYSTEM_{}", number)); told != pool.end()) {
      system = told->second.empty() ? 0 : told->second.front();
    }
    if (system != 1 && system != 2) {
      refuse("has a time system that is neither 1 (TDB) nor 2 (TDT)", "correct SCLK01_TIME_SYSTEM");
    }
    scale_ = system == 1 ? TimeScale::kTdb : TimeScale::kTt;
    const std::vector<double>& moduli = values("SCLK01_MODULI");
    for (std::size_t i = 1; i < moduli.size(); ++i) {
      ticks_per_count_ *= moduli[i];
    }
    if (!(ticks_per_count_ >= 1 && ticks_per_count_ <= kMostTicks)) {
      refuse("has moduli of the clock that cannot be", "correct SCLK01_MODULI");
    }
    rows_ = values("SCLK01_COEFFICIENTS");
    if (rows_.size() % 3 != 0) {
      refuse("has coefficients that are not in threes", "correct SCLK01_COEFFICIENTS");
    }
    for (std::size_t i = 0; i < rows_.size(); i += 3) {
      if (!(std::abs(rows_[i]) <= kMostTicks && std::abs(rows_[i + 1]) < kMostSeconds && rows_[i + 2] > 0) ||
          (i > 0 && rows_[i] <= rows_[i - 3])) {
        refuse("has coefficients of the clock that cannot be, or are out of order", "correct SCLK01_COEFFICIENTS");
      }
    }
  }

  [[nodiscard]] TimeScale scale() const { return scale_; }

  /// Nothing where the clock does not know the time.
  [[nodiscard]] std::optional<Time> time(double ticks) {
    std::size_t row = 0;
    while (row + 3 < rows_.size() && rows_[row + 3] <= ticks) {
      row += 3;
    }
    const double since_s = (ticks - rows_[row]) / ticks_per_count_ * rows_[row + 2];
    if (!(ticks >= rows_[0]) || !(std::abs(since_s) + std::abs(rows_[row + 1]) < kMostSeconds)) {
      return std::nullopt;
    }
    static const Time j2000 = parse_epoch("2000-01-01T12:00:00").value();
    // Apart: together they would have less than nanoseconds.
    return text_of(scale_).tai_of(j2000 + from_seconds(rows_[row + 1]) + from_seconds(since_s));
  }

 private:
  [[noreturn]] void refuse(std::string reason, std::string cure) const {
    throw InputRefused(file_, {}, std::move(reason), std::move(cure));
  }
  TimeText& text_of(TimeScale scale) {
    if (!clock_) {
      clock_.emplace(scale);
    }
    return *clock_;
  }

  fs::path file_;
  TimeScale scale_ = TimeScale::kTt;
  double ticks_per_count_ = 1;
  std::vector<double> rows_;  ///< ticks, seconds since J2000, seconds per count of the first field
  std::optional<TimeText> clock_;
};

// ---- DAF: NAIF's daf.req and ck.req

constexpr std::size_t kRecord = 1024;
constexpr std::size_t kWord = sizeof(double);

struct Segment {
  std::int32_t instrument = 0;
  std::int32_t frame = 0;
  std::int32_t type = 0;
  bool has_rates = false;
  std::size_t first = 0;  ///< words, from 0
  std::size_t end = 0;
};

class Kernel {
 public:
  Kernel(std::string_view bytes, const fs::path& file) : bytes_(bytes), file_(file) {
    if (bytes_.size() < kRecord || bytes_.size() % kWord != 0) {
      refuse(fmt::format("has {} bytes, which no kernel has", bytes_.size()), "get the file again, as a whole");
    }
    const std::string_view format = bytes_.substr(88, 8);
    if (format != "LTL-IEEE" && format != "BIG-IEEE") {
      refuse(fmt::format("its numbers are written as {}", in_quotes(trimmed(format))),
             "convert it to LTL-IEEE, as bingo of NAIF does");
    }
    is_swapped_ = (format == "LTL-IEEE") != (std::endian::native == std::endian::little);
    if (integer(8) != 2 || integer(12) != 6) {
      refuse("has no summaries of pointing", "give a CK kernel");
    }
  }

  [[noreturn]] void refuse(std::string reason, std::string cure) const {
    throw InputRefused(file_, {}, std::move(reason), std::move(cure));
  }

  /// In the order of the file.
  [[nodiscard]] std::vector<Segment> segments() const {
    constexpr std::size_t kSummary = 5;  // words
    constexpr std::size_t kMostInRecord = 25;
    std::vector<Segment> found;
    std::size_t visited = 0;
    for (double next = integer(76); next != 0;) {
      check_stop();
      const std::size_t record = index(next, bytes_.size() / kRecord, "record of summaries");
      const std::size_t at = (record - 1) * (kRecord / kWord);
      if (++visited > bytes_.size() / kRecord) {
        refuse("its records of summaries lead back to each other", "get the file again");
      }
      const std::size_t count = index(word(at + 2), kMostInRecord, "number of summaries");
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t offset = (at + 3 + i * kSummary + 2) * kWord;
        Segment its{integer(offset), integer(offset + 4), integer(offset + 8), integer(offset + 12) != 0, 0, 0};
        const std::size_t words = bytes_.size() / kWord;
        its.first = index(integer(offset + 16), words, "address") - 1;
        its.end = index(integer(offset + 20), words, "address");
        if (its.first >= its.end) {
          refuse("a segment of it ends before it begins", "get the file again");
        }
        found.push_back(its);
      }
      next = word(at);
    }
    if (found.empty()) {
      refuse("holds no pointing", "give a CK kernel with a segment");
    }
    return found;
  }

  [[nodiscard]] double word(std::size_t i) const {
    std::uint64_t raw = 0;
    std::memcpy(&raw, bytes_.data() + i * kWord, kWord);
    return std::bit_cast<double>(is_swapped_ ? __builtin_bswap64(raw) : raw);
  }

  /// A whole number from 1 to `most`.
  [[nodiscard]] std::size_t index(double value, std::size_t most, std::string_view what) const {
    if (!(value >= 1 && value <= static_cast<double>(most)) || value != std::floor(value)) {
      refuse(fmt::format("a {} of it is {:g}, not between 1 and {}", what, value, most), "get the file again");
    }
    return static_cast<std::size_t>(value);
  }

 private:
  [[nodiscard]] std::int32_t integer(std::size_t offset) const {
    std::uint32_t raw = 0;
    std::memcpy(&raw, bytes_.data() + offset, sizeof raw);
    return std::bit_cast<std::int32_t>(is_swapped_ ? __builtin_bswap32(raw) : raw);
  }

  std::string_view bytes_;
  const fs::path& file_;
  bool is_swapped_ = false;
};

/// Appends the pointing of a segment.
void take(const Kernel& kernel, const Segment& segment, Clock& clock, AttitudeMessage& message) {
  const std::size_t words = segment.end - segment.first;
  const std::size_t per_row = segment.has_rates ? 7 : 4;
  const std::size_t counts = segment.type == 3 ? 2 : 1;
  const std::size_t most = words < counts ? 0 : (words - counts) / (per_row + 1);
  const std::size_t rows = kernel.index(kernel.word(segment.end - 1), most, "number of attitudes");
  std::size_t expected = rows * (per_row + 1) + (rows - 1) / 100 + counts;
  if (segment.type == 3) {
    const std::size_t intervals = kernel.index(kernel.word(segment.end - 2), rows, "number of intervals");
    expected += intervals + (intervals - 1) / 100;
    message.segments += intervals;
  } else {
    ++message.segments;
  }
  if (words != expected) {
    kernel.refuse(fmt::format("a segment of it has {} numbers, and {} attitudes take {}", words, rows, expected),
                  "get the file again");
  }
  AttitudeHistory& attitude = message.attitude;
  for (std::size_t i = 0; i < rows; ++i) {
    check_stop();
    const std::size_t at = segment.first + i * per_row;
    const double ticks = kernel.word(segment.first + rows * per_row + i);
    const std::optional<Time> t = clock.time(ticks);
    if (!t || (!attitude.t.empty() && *t <= attitude.t.back())) {
      kernel.refuse(t ? fmt::format("its attitude at {} ticks is not later than the one before", ticks)
                      : fmt::format("its clock does not know the time of {} ticks", ticks),
                    t ? "give a kernel whose segments follow each other"
                      : "give the SCLK kernel of this attitude, in the years 1958 to 2200");
    }
    const Eigen::Quaterniond q(kernel.word(at), kernel.word(at + 1), kernel.word(at + 2), kernel.word(at + 3));
    if (!is_unit(q)) {
      kernel.refuse(fmt::format("its quaternion at {} ticks has the norm {:.6g}, not 1", ticks, q.norm()),
                    "get the file again");
    }
    // That of the matrix from J2000 to c.
    attitude.t.push_back(*t);
    attitude.q_in_c.push_back(q.conjugate());
    if (segment.has_rates) {
      const Eigen::Vector3d in(kernel.word(at + 4), kernel.word(at + 5), kernel.word(at + 6));
      if (!(in.norm() < 1e3)) {
        kernel.refuse(fmt::format("its angular velocity at {} ticks is none", ticks), "get the file again");
      }
      message.rate_rad_s.emplace_back(q * in);
    }
  }
}

}  // namespace
}  // namespace ck

bool is_c_kernel(std::string_view bytes) { return bytes.starts_with("DAF/CK"); }

AttitudeMessage parse_c_kernel(std::string_view bytes, const std::filesystem::path& file, std::string_view clock,
                               const std::filesystem::path& clock_file) {
  constexpr std::int32_t kJ2000 = 1;
  constexpr std::int32_t kPerSpacecraft = 1000;
  const ck::Kernel kernel(bytes, file);
  const std::vector<ck::Segment> segments = kernel.segments();
  const std::int32_t instrument = segments.front().instrument;
  ck::Clock its_clock(ck::ClockKernel(clock, clock_file).read(), std::abs(std::int64_t{instrument} / kPerSpacecraft),
                      clock_file);
  AttitudeMessage message;
  message.format = fmt::format("SPICE CK of type {}", segments.front().type);
  message.object_name = fmt::to_string(instrument / kPerSpacecraft);
  message.object_id = "UNKNOWN";
  message.inertial_frame = "J2000";
  message.body_frame = fmt::to_string(instrument);
  message.time_system = name_of(its_clock.scale());
  const bool all_have_rates = std::ranges::all_of(segments, &ck::Segment::has_rates);
  for (const ck::Segment& segment : segments) {
    if (segment.instrument != instrument) {
      kernel.refuse(fmt::format("holds the pointing of {} and of {}", instrument, segment.instrument),
                    "give each a kernel of its own");
    }
    if (segment.frame != kJ2000) {
      kernel.refuse(fmt::format("its attitude is relative to frame {}, not to J2000", segment.frame),
                    "give it relative to J2000 (1)");
    }
    if (segment.type != 1 && segment.type != 3) {
      kernel.refuse(fmt::format("is a CK of type {}", segment.type), "give one of type 1 or 3");
    }
    ck::take(kernel, segment, its_clock, message);
  }
  if (!all_have_rates) {
    message.rate_rad_s.clear();
  }
  return message;
}

AttitudeMessage read_c_kernel(std::string_view bytes, const std::filesystem::path& file) {
  const std::filesystem::path clock_file = std::filesystem::path(file).replace_extension(".tsc");
  std::error_code ignored;
  if (!std::filesystem::exists(clock_file, ignored)) {
    throw InputRefused(file, {}, fmt::format("is a C-kernel, and its clock {} is not there", clock_file.string()),
                       "put the SCLK kernel beside it, under its name with the ending .tsc");
  }
  return parse_c_kernel(bytes, file, TextFile(clock_file).text(), clock_file);
}

}  // namespace trihedron::io
