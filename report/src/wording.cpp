#include "wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "trihedron/records/text.hpp"

namespace trihedron::report {
namespace {

constexpr const char* kThinSpace = "\u202f";
constexpr const char* kMinus = "\u2212";

std::string typeset(std::string digits) {
  const std::size_t first = digits.find_first_of("0123456789");
  const std::size_t point = std::min(digits.find('.'), digits.size());
  for (std::size_t place = point; place > first + 3;) {
    place -= 3;
    digits.insert(place, kThinSpace);
  }
  if (digits.front() == '-') {
    digits.replace(0, 1, kMinus);
  }
  return digits;
}

}  // namespace

std::string number(double value, int decimals) {
  return std::isfinite(value) ? typeset(fmt::format("{:.{}f}", value, decimals)) : "—";
}

std::string signed_number(double value, int decimals) {
  return std::isfinite(value) ? typeset(fmt::format("{:+.{}f}", value, decimals)) : "—";
}

std::string significant(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) {
    return number(value, 0);
  }
  return number(value, std::clamp(digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 12));
}

std::string of_axes(const Eigen::Vector3d& v) {
  const AngleUnit unit = unit_of_angles({v.data(), 3});
  return fmt::format("{} / {} / {}{}", significant(v.x() / unit.rad, 2), significant(v.y() / unit.rad, 2),
                     significant(v.z() / unit.rad, 2), unit.symbol);
}

std::string angle(double rad, int digits) {
  const AngleUnit unit = unit_of_angle(rad);
  return std::isfinite(rad) ? significant(rad / unit.rad, digits) + unit.symbol : number(rad, 0);
}

std::string limit_text(double rad) {
  const AngleUnit unit = unit_of_angle(rad);
  return fmt::format("{:.3g}{}", rad / unit.rad, unit.symbol);
}

int decimals_for(double sigma) {
  return sigma > 0 && std::isfinite(sigma) ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 9) : 3;
}

std::string counted(long count, const std::string& one, const std::string& many) {
  return number(static_cast<double>(count), 0) + " " + (count == 1 ? one : many);
}

std::string calendar(Time t) {
  using namespace std::chrono;  // NOLINT(google-build-using-namespace): year{1958} / 1 / 1 is written for it
  // The count of days of TAI, read as a calendar without leap seconds.
  const sys_time<nanoseconds> civil{t.time_since_epoch() + sys_days{year{1958} / 1 / 1}.time_since_epoch()};
  const auto day = floor<days>(civil);
  const year_month_day date{day};
  const hh_mm_ss time{floor<seconds>(civil - day)};
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} TAI", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), time.hours().count(),
                     time.minutes().count(), time.seconds().count());
}

std::string span(Duration d) {
  const long seconds = std::lround(to_seconds(d));
  if (seconds < 120) {
    return fmt::format("{} s", seconds);
  }
  const long minutes = std::lround(to_seconds(d) / 60);
  return minutes < 120 ? fmt::format("{} min", minutes) : fmt::format("{} h {:02} min", minutes / 60, minutes % 60);
}

std::string reference_in_words(const ground::AttitudeEvaluation& evaluation) {
  return fmt::format("the {}", name_of(evaluation.reference));
}

}  // namespace trihedron::report
