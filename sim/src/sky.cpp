#include "trihedron/sim/sky.hpp"

#include <erfa.h>
#include <erfam.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "trihedron/records/stop.hpp"

namespace trihedron::sim {
namespace {

constexpr double kSpacing_s = 3600;
constexpr double kMjd1958 = 36204;
constexpr double kTtMinusTai_s = 32.184;

SkyState sky_at(Time epoch, double t_s) {
  const double days_1958 = (to_seconds(epoch.time_since_epoch()) + t_s + kTtMinusTai_s) / ERFA_DAYSEC;
  double heliocentric[2][3];
  double barycentric[2][3];
  // TT for TDB: 2 ms apart at most. The status tells of dates outside 1900 … 2100, where accuracy falls off slowly.
  eraEpv00(ERFA_DJM0 + kMjd1958, days_1958, heliocentric, barycentric);
  const Eigen::Vector3d earth_au(heliocentric[0]);
  const Eigen::Vector3d velocity_au_day(barycentric[1]);
  return {Vec<In>::assume(-earth_au * ERFA_DAU), Vec<In>::assume(velocity_au_day * (ERFA_DAU / ERFA_DAYSEC))};
}

}  // namespace

Sky::Sky(Time epoch, double begin_s, double end_s) : begin_s_(begin_s) {
  const auto intervals = static_cast<int>(std::ceil((end_s - begin_s) / kSpacing_s)) + 1;
  for (int i = 0; i <= intervals; ++i) {
    check_stop();
    table_.push_back(sky_at(epoch, begin_s + i * kSpacing_s));
  }
}

SkyState Sky::at(double t_s) const {
  const double position = (t_s - begin_s_) / kSpacing_s;
  const double i = std::clamp(std::floor(position), 0.0, static_cast<double>(table_.size() - 2));
  const double b = position - i;
  const SkyState& before = table_[static_cast<std::size_t>(i)];
  const SkyState& after = table_[static_cast<std::size_t>(i) + 1];
  return {(1 - b) * before.sun_m + b * after.sun_m, (1 - b) * before.earth_velocity_m_s + b * after.earth_velocity_m_s};
}

}  // namespace trihedron::sim
