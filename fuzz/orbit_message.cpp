#include "oem.hpp"
#include "target.hpp"

void trihedron::fuzz::read_orbit_message(std::string_view bytes) {
  const io::OrbitMessage message =
      io::parse_orbit_message(bytes, "orbit.oem", Time(Duration(1'621'468'800'000'000'000)));
  expect(!message.segments.empty(), "segments");
  double end_s = message.segments.front().begin_s;
  for (const EphemerisSegment& its : message.segments) {
    expect(its.begin_s >= end_s && its.end_s >= its.begin_s, "segments in order");
    end_s = its.end_s;
    expect(its.t_s.size() >= its.nodes() && its.position_m.size() == its.t_s.size() &&
               its.velocity_m_s.size() == its.t_s.size(),
           "states for the interpolation");
    expect(its.t_s.front() <= its.begin_s && its.t_s.back() >= its.end_s, "states over the useable span");
    for (std::size_t i = 1; i < its.t_s.size(); ++i) {
      expect(its.t_s[i - 1] < its.t_s[i], "times that increase");
    }
  }
}
