#pragma once
/// The Sun as seen from the Earth, and the Earth's motion, from ERFA's analytic ephemeris (eraEpv00).

#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::sim {

/// Sun and Earth at one time.
struct SkyState {
  Vec<In> sun_m;               ///< from the Earth's centre
  Vec<In> earth_velocity_m_s;  ///< of the Earth's centre, relative to the solar system's barycentre
};

/// The ephemeris, tabulated every hour and linear between: over an hour the Earth's velocity departs from a straight
/// line by less than 2 mm/s.
class Sky {
 public:
  /// For the times epoch + begin_s … epoch + end_s. Accurate for 1900 … 2100.
  Sky(Time epoch, double begin_s, double end_s);

  [[nodiscard]] SkyState at(double t_s) const;

 private:
  double begin_s_;
  std::vector<SkyState> table_;
};

}  // namespace trihedron::sim
