#include "trihedron/records/readiness.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace trihedron {
namespace {

/// In arcminutes, or in arcseconds below one; three digits.
std::string angle_in_words(double angle_rad) {
  const double arcminutes = angle_rad * 180 * 60 / std::numbers::pi;
  char text[32];
  std::snprintf(text, sizeof text, "%.3g%s", arcminutes < 1 ? 60 * arcminutes : arcminutes, arcminutes < 1 ? "″" : "′");
  return text;
}

}  // namespace

double readiness_s(const Housekeeping& record) {
  if (record.attitude_valid == 0 || record.predicted == 0) {
    return 0;
  }
  const double since_s = static_cast<double>(record.time_ns - record.corrected_ns) / 1e9;
  return std::max(record.ready_s - since_s, 0.0);
}

std::string readiness_in_words(const Housekeeping& record) {
  if (record.attitude_valid == 0) {
    return "no attitude";
  }
  if (record.predicted == 0) {
    return "not yet known: the stretch for a prediction has not been flown";
  }
  const std::string error = angle_in_words(record.required_error_rad);
  const double minutes = std::floor(readiness_s(record) / 60);
  if (!(minutes > 0)) {
    return "attitude not within " + error + " without the star tracker (99.7 %)";
  }
  char duration[32];
  std::snprintf(duration, sizeof duration, "%.0f min", minutes);
  return (record.adopted != 0 ? "attitude within " : "if adopted, attitude within ") + error + " for the next " +
         duration + " (99.7 %)";
}

}  // namespace trihedron
