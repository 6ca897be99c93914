#include "trihedron/records/open_loop_forecast.hpp"

#include <cstdio>

#include "trihedron/records/text.hpp"

namespace trihedron {
namespace {

/// 5′ rather than 5.00′.
std::string limit_text(double rad) {
  const AngleUnit unit = unit_of_angle(rad);
  char text[32];
  std::snprintf(text, sizeof text, "%.4g%s", rad / unit.rad, unit.symbol);
  return text;
}

}  // namespace

std::string time_in_words(Duration time) {
  constexpr long kMinutesUpTo = 120;
  const long minutes = time / std::chrono::minutes(1);
  if (minutes < 1) {
    return "less than a minute";
  }
  if (minutes < kMinutesUpTo) {
    return std::to_string(minutes) + " min";
  }
  const std::string hours = std::to_string(minutes / 60) + " h";
  return minutes % 60 == 0 ? hours : hours + " " + std::to_string(minutes % 60) + " min";
}

std::string in_words(const AccuracyForecast& accuracy) {
  const std::string limit = limit_text(accuracy.limit_rad);
  if (!accuracy.is_lower_bound && accuracy.within < std::chrono::minutes(1)) {
    return "attitude not within " + limit + " even after a correction (99.7 %)";
  }
  return "attitude within " + limit + " for " + time_in_words(accuracy.within) +
         (accuracy.is_lower_bound ? " and longer" : "") + " after a correction (99.7 %)";
}

std::string in_words(const Need& need) { return limit_text(need.error_rad) + " for " + time_in_words(need.interval); }

}  // namespace trihedron
