#include "trihedron/io/time_scale.hpp"

#include <erfa.h>
#include <erfam.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>

#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

using std::chrono::days;
using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;

constexpr std::chrono::sys_days kOrigin = std::chrono::year(1958) / 1 / 1;
constexpr Duration kTtMinusTai = std::chrono::milliseconds(32184);
constexpr Duration kTaiMinusGps = seconds(19);
constexpr double kOriginMjd = 36204;  // of 1958-01-01

/// A reading of a clock: whole days since 1958-01-01, and the time since its midnight, which is a day or more within a
/// leap second.
struct ClockReading {
  days day{};
  Duration since_midnight{};
  bool leap = false;  ///< the seconds are 60
  bool zulu = false;
};

/// TAI − UTC on a day of UTC. Nothing where it is not known in whole seconds.
std::optional<Duration> leap_seconds(days day) {
  const std::chrono::year_month_day date(kOrigin + day);
  const int year = static_cast<int>(date.year());
  double tai_minus_utc_s = 0;
  // A positive status means that the year lies beyond those that the table was made for.
  if (year < 1972 || eraDat(year, static_cast<int>(static_cast<unsigned>(date.month())),
                            static_cast<int>(static_cast<unsigned>(date.day())), 0, &tai_minus_utc_s) != 0) {
    return std::nullopt;
  }
  return seconds(std::lround(tai_minus_utc_s));
}

constexpr std::string_view kUtcUnknown =
    "is a date for which this program's table of leap seconds has no entry: it begins in 1972, and ends some years "
    "after it was made";

int take_digits(std::string_view& text, std::size_t count) {
  if (text.size() < count || !std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(count),
                                          [](unsigned char c) { return std::isdigit(c) != 0; })) {
    return -1;
  }
  int value = 0;
  for (const char c : text.substr(0, count)) {
    value = value * 10 + (c - '0');
  }
  text.remove_prefix(count);
  return value;
}

bool skip(std::string_view& text, char c) {
  const bool there = text.starts_with(c);
  text.remove_prefix(there ? 1 : 0);
  return there;
}

/// Takes the digits after a decimal point, rounded to nanoseconds; −1 where there are none.
std::int64_t take_fraction_ns(std::string_view& text) {
  std::int64_t ns = 0;
  std::size_t digits = 0;
  for (; !text.empty() && std::isdigit(static_cast<unsigned char>(text.front())) != 0; ++digits) {
    const int digit = text.front() - '0';
    if (digits < 9) {
      ns = ns * 10 + digit;
    } else if (digits == 9 && digit >= 5) {
      ++ns;
    }
    text.remove_prefix(1);
  }
  for (std::size_t i = digits; i < 9; ++i) {
    ns *= 10;
  }
  return digits == 0 ? -1 : ns;
}

std::optional<std::chrono::year_month_day> take_date(std::string_view& text) {
  const int year = take_digits(text, 4);
  if (year < 1958 || year > 2200 || !skip(text, '-')) {
    return std::nullopt;
  }
  const std::chrono::year y(year);
  if (text.size() > 3 && text[3] == 'T') {
    const int day_of_year = take_digits(text, 3);
    if (day_of_year < 1 || day_of_year > (y.is_leap() ? 366 : 365)) {
      return std::nullopt;
    }
    return std::chrono::sys_days(y / 1 / 1) + days(day_of_year - 1);
  }
  const int month = take_digits(text, 2);
  const bool dash = skip(text, '-');
  const int day = take_digits(text, 2);
  if (!dash || month < 0 || day < 0) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date =
      y / std::chrono::month(static_cast<unsigned>(month)) / std::chrono::day(static_cast<unsigned>(day));
  return date.ok() ? std::optional(date) : std::nullopt;
}

std::optional<ClockReading> parse_reading(std::string_view text) {
  const std::optional<std::chrono::year_month_day> date = take_date(text);
  if (!date || !skip(text, 'T')) {
    return std::nullopt;
  }
  const int hour = take_digits(text, 2);
  const bool colon1 = skip(text, ':');
  const int minute = take_digits(text, 2);
  const bool colon2 = skip(text, ':');
  const int second = take_digits(text, 2);
  if (!colon1 || !colon2 || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60 ||
      (second == 60 && (hour != 23 || minute != 59))) {
    return std::nullopt;
  }
  const std::int64_t fraction_ns = skip(text, '.') ? take_fraction_ns(text) : 0;
  const bool zulu = skip(text, 'Z');
  if (fraction_ns < 0 || !text.empty()) {
    return std::nullopt;
  }
  return ClockReading{std::chrono::sys_days(*date) - kOrigin,
                      hours(hour) + minutes(minute) + seconds(second) + Duration(fraction_ns), second == 60, zulu};
}

}  // namespace

std::string name_of(TimeScale scale) { return std::string(kTimeScales[static_cast<std::size_t>(scale)]); }

std::optional<TimeScale> time_scale_named(std::string_view name) {
  const auto same = [&](std::string_view known) {
    return std::ranges::equal(name, known, [](unsigned char a, unsigned char b) { return std::toupper(a) == b; });
  };
  const auto* found = std::ranges::find_if(kTimeScales, same);
  return found == kTimeScales.end() ? std::nullopt : std::optional(static_cast<TimeScale>(found - kTimeScales.begin()));
}

Duration TimeText::tdb_minus_tt(Time tt) {
  constexpr std::int64_t kCell_ns = 600'000'000'000;
  const std::int64_t ns = tt.time_since_epoch().count();
  const std::int64_t cell = ns >= 0 ? ns / kCell_ns : (ns - kCell_ns + 1) / kCell_ns;
  if (cell != cell_) {
    // eraDtdb takes TDB or TT alike; without a place on the Earth it gives the value at the geocentre.
    const auto at = [](std::int64_t node) {
      return eraDtdb(ERFA_DJM0 + kOriginMjd, static_cast<double>(node) / 144, 0, 0, 0, 0);
    };
    cell_ = cell;
    cell_begin_s_ = at(cell);
    cell_end_s_ = at(cell + 1);
  }
  const double part = static_cast<double>(ns - cell * kCell_ns) / static_cast<double>(kCell_ns);
  return from_seconds(cell_begin_s_ + part * (cell_end_s_ - cell_begin_s_));
}

std::string TimeText::format(Time t) {
  switch (scale_) {
    case TimeScale::kTai:
      return format_epoch(t);
    case TimeScale::kGps:
      return format_epoch(t - kTaiMinusGps);
    case TimeScale::kTt:
      return format_epoch(t + kTtMinusTai);
    case TimeScale::kTdb:
      return format_epoch(t + kTtMinusTai + tdb_minus_tt(t + kTtMinusTai));
    case TimeScale::kUtc:
      break;
  }
  // The day of UTC is that of TAI or the one before.
  const days day_of_tai = std::chrono::floor<days>(t.time_since_epoch());
  for (const days day : {day_of_tai, day_of_tai - days(1)}) {
    const std::optional<Duration> leaps = leap_seconds(day);
    if (!leaps) {
      throw UsageError(
          fmt::format("{} TAI {}; use the time system TAI, or a newer ERFA", format_epoch(t), kUtcUnknown));
    }
    const Duration since_midnight = t.time_since_epoch() - day - *leaps;
    if (since_midnight < Duration::zero()) {
      continue;
    }
    const bool leap = since_midnight >= days(1);
    std::string text = format_epoch(Time(day + since_midnight - (leap ? Duration(seconds(1)) : Duration::zero())));
    if (leap) {
      text.replace(text.find(":59:59") + 4, 2, "60");
    }
    return text;
  }
  throw UsageError(fmt::format("{} TAI is no instant of UTC; use the time system TAI", format_epoch(t)));
}

std::optional<Time> TimeText::parse(std::string_view text, Fault& fault) {
  const std::optional<ClockReading> reading = parse_reading(text);
  if (!reading) {
    fault = {fmt::format("{} is no time", in_quotes(text)),
             "write it as 2009-05-20T00:00:00.125 or 2009-140T00:00:00.125, in the years 1958 to 2200"};
    return std::nullopt;
  }
  if (reading->zulu && scale_ != TimeScale::kUtc) {
    fault = {
        fmt::format("{} ends with Z, which means UTC, but the time system is {}", in_quotes(text), name_of(scale_)),
        "take the Z off, or correct TIME_SYSTEM"};
    return std::nullopt;
  }
  Duration leaps{};
  bool day_has_leap_second = false;
  if (scale_ == TimeScale::kUtc) {
    const std::optional<Duration> today = leap_seconds(reading->day);
    const std::optional<Duration> tomorrow = leap_seconds(reading->day + days(1));
    if (!today || !tomorrow) {
      fault = {fmt::format("{} {}", in_quotes(text), kUtcUnknown), "give the file in TAI, or use a newer ERFA"};
      return std::nullopt;
    }
    leaps = *today;
    day_has_leap_second = *tomorrow > *today;
  }
  if (reading->leap && !day_has_leap_second) {
    fault = {fmt::format("{} lies in a leap second that there is not", in_quotes(text)),
             "seconds go to 60 only where a day of UTC ends with a leap second"};
    return std::nullopt;
  }
  const Time clock(reading->day + reading->since_midnight);
  return scale_ == TimeScale::kUtc ? clock + leaps : tai_of(clock);
}

std::optional<Time> TimeText::tai_of(Time clock) {
  switch (scale_) {
    case TimeScale::kTai:
      return clock;
    case TimeScale::kGps:
      return clock + kTaiMinusGps;
    case TimeScale::kTt:
      return clock - kTtMinusTai;
    case TimeScale::kUtc: {
      const std::optional<Duration> leaps = leap_seconds(std::chrono::floor<days>(clock.time_since_epoch()));
      return leaps ? std::optional(clock + *leaps) : std::nullopt;
    }
    case TimeScale::kTdb:
      break;
  }
  Time tt = clock;  // TDB − TT changes by 3e-10 of the time, so that one repetition is exact
  for (int i = 0; i < 3; ++i) {
    tt = clock - tdb_minus_tt(tt);
  }
  return tt - kTtMinusTai;
}

std::string utc_now() {
  const auto now = std::chrono::floor<seconds>(std::chrono::system_clock::now());
  return format_epoch(Time(now.time_since_epoch() - kOrigin.time_since_epoch()));
}

}  // namespace trihedron::io
