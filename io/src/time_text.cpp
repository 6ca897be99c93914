#include "trihedron/io/time_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "trihedron/records/text.hpp"

namespace trihedron::io {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;

constexpr std::chrono::sys_days kTaiOrigin = std::chrono::year(1958) / 1 / 1;

/// Takes exactly `digits` decimal digits off the head; −1 when they are not there.
int take_number(std::string_view& text, std::size_t digits) {
  const std::string_view number = text.substr(0, digits);
  int value = 0;
  const auto read = std::from_chars(number.data(), number.data() + number.size(), value);
  if (number.size() < digits || number.front() == '-' || read.ptr != number.data() + digits) {
    return -1;
  }
  text.remove_prefix(digits);
  return value;
}

bool take(std::string_view& text, char c) {
  const bool there = text.starts_with(c);
  text.remove_prefix(there ? 1 : 0);
  return there;
}

}  // namespace

std::optional<Time> parse_epoch(std::string_view iso) {
  const int year = take_number(iso, 4);
  const bool dash1 = take(iso, '-');
  const int month = take_number(iso, 2);
  const bool dash2 = take(iso, '-');
  const int day = take_number(iso, 2);
  const bool t = take(iso, 'T');
  const int hour = take_number(iso, 2);
  const bool colon1 = take(iso, ':');
  const int minute = take_number(iso, 2);
  const bool colon2 = take(iso, ':');
  const int second = take_number(iso, 2);
  if (!(dash1 && dash2 && t && colon1 && colon2) || year < 1958 || year > 2200 || month < 0 || day < 0 || hour < 0 ||
      hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 59) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok()) {
    return std::nullopt;
  }
  int fraction_ns = 0;
  if (take(iso, '.')) {
    const std::size_t digits = iso.size();
    fraction_ns = digits >= 1 && digits <= 9 ? take_number(iso, digits) : -1;
    for (std::size_t i = digits; i < 9; ++i) {
      fraction_ns *= 10;
    }
  }
  if (!iso.empty() || fraction_ns < 0) {
    return std::nullopt;
  }
  return Time(std::chrono::sys_days(date) - kTaiOrigin + hours(hour) + minutes(minute) + seconds(second) +
              Duration(fraction_ns));
}

std::string format_epoch(Time epoch) { return iso_time(epoch); }

std::string format_seconds(Duration duration) {
  const char* sign = duration < Duration::zero() ? "-" : "";
  const Duration size = std::chrono::abs(duration);
  const seconds whole = std::chrono::floor<seconds>(size);
  const Duration fraction = size - whole;
  return fraction % milliseconds(1) == Duration::zero()
             ? fmt::format("{}{}.{:03}", sign, whole.count(), fraction / milliseconds(1))
             : fmt::format("{}{}.{:09}", sign, whole.count(), fraction.count());
}

}  // namespace trihedron::io
