#include "trihedron/sim/attitude.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "trihedron/records/stop.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::Vector4d;

Rot<In, C> from_axes(const Vector3d& x, const Vector3d& y, const Vector3d& z) {
  Matrix3d m;
  m << x, y, z;
  return Rot<In, C>::assume(m);
}

/// The reference attitude as samples for a spline, which is several times faster than the formulas: it is evaluated at
/// each step of 8 Hz.
std::vector<AttitudeSample> reference_samples(const AttitudeScenario& scenario, const Ephemeris& ephemeris,
                                              double begin_s, double end_s) {
  using Reference = AttitudeScenario::Reference;
  switch (scenario.reference) {
    case Reference::kRecorded:
      return scenario.recorded;
    case Reference::kInertial:
      return {{begin_s, scenario.inertial_q_in_c}, {end_s, scenario.inertial_q_in_c}};
    case Reference::kOrbital:
    case Reference::kYawSteered:
      break;
  }
  // In a low orbit the error of a cubic spline through samples 2 s apart is (5/384) (n/2 · 2 s)⁴ ≈ 2e-14 rad. The
  // natural boundary conditions add 1e-7 rad at the ends, which falls by a factor of 3.7 per sample: a margin of 20
  // samples keeps it out of the pass.
  constexpr double kSpacing_s = 2;
  constexpr double kMargin_s = 20 * kSpacing_s;
  const auto attitude = scenario.reference == Reference::kOrbital ? orbital_attitude : yaw_steered_attitude;
  const auto intervals = static_cast<int>(std::ceil((end_s - begin_s + 2 * kMargin_s) / kSpacing_s));
  std::vector<AttitudeSample> samples;
  for (int i = 0; i <= intervals; ++i) {
    check_stop();
    const double t = begin_s - kMargin_s + i * kSpacing_s;
    samples.push_back({t, attitude(ephemeris.at(t)).quaternion()});
  }
  return samples;
}

/// The unit quaternion of a rotation vector.
Quaterniond turn(const Vector3d& rotation_vector_rad) {
  const Vector3d half = rotation_vector_rad / 2;
  const double x = half.squaredNorm();
  // Series of cos and sin(x)/x where they are exact to rounding, x³/5040 < 1e-16. Jitter, evaluated at every step,
  // takes this branch.
  if (x < 5e-5) {
    const double sinc = 1 + x * (-1.0 / 6 + x / 120);
    return {1 + x * (-1.0 / 2 + x * (1.0 / 24 - x / 720)), sinc * half.x(), sinc * half.y(), sinc * half.z()};
  }
  const double angle = std::sqrt(x);
  const double sinc = std::sin(angle) / angle;
  return {std::cos(angle), sinc * half.x(), sinc * half.y(), sinc * half.z()};
}

/// The shortest rotation vector of a unit quaternion.
Vector3d rotation_vector(const Quaterniond& q) { return Rot<C, C>::assume(q).log().raw(); }

}  // namespace

Rot<In, C> orbital_attitude(const OrbitState& state) {
  const Vector3d z = state.position_m.raw().normalized();
  const Vector3d y = state.position_m.raw().cross(state.velocity_m_s.raw()).normalized();
  return from_axes(y.cross(z), y, z);
}

Rot<In, C> yaw_steered_attitude(const OrbitState& state) {
  const Vector3d earth_rate(0, 0, kEarthRate_rad_s);
  const Vec<In> over_ground = Vec<In>::assume(state.velocity_m_s.raw() - earth_rate.cross(state.position_m.raw()));
  return orbital_attitude({state.position_m, over_ground});
}

// The turn's angle is Δ s(u), u = 0 … 1 in time, s = 10u³ − 15u⁴ + 6u⁵: max s' = 15/8, max s'' = 10/√3.
double turn_duration_s(double angle_rad, double max_rate_rad_s, double max_acceleration_rad_s2) {
  const double angle = std::abs(angle_rad);
  return std::max(15.0 / 8.0 * angle / max_rate_rad_s,
                  std::sqrt(10.0 / std::numbers::sqrt3 * angle / max_acceleration_rad_s2));
}

Quaterniond slew_target(const Slew& slew) {
  return turn({0, 0, slew.yaw_rad}) * turn({0, slew.pitch_rad, 0}) * turn({slew.roll_rad, 0, 0});
}

SlewPlan::SlewPlan(const std::vector<Slew>& slews, double max_rate_rad_s, double max_acceleration_rad_s2) {
  if (!(max_rate_rad_s > 0 && max_acceleration_rad_s2 > 0)) {
    throw std::invalid_argument("slews: limits of rate and acceleration must be positive");
  }
  Quaterniond from = Quaterniond::Identity();
  for (const Slew& slew : slews) {
    if (!turns_.empty() && !(slew.begin_s >= turns_.back().end_s)) {
      std::ostringstream reason;
      reason << "slews: the slew at " << slew.begin_s << " s begins before the one before has ended, at "
             << turns_.back().end_s << " s: begin it later, or raise max_slew_rate or max_slew_acceleration";
      throw std::invalid_argument(reason.str());
    }
    const Quaterniond to = slew_target(slew);
    const Vector3d v = rotation_vector(from.conjugate() * to);
    const double duration = turn_duration_s(v.norm(), max_rate_rad_s, max_acceleration_rad_s2);
    turns_.push_back({slew.begin_s, slew.begin_s + duration, from, to, v});
    from = to;
  }
}

Quaterniond SlewPlan::at(double t_s) const {
  const auto after = std::ranges::upper_bound(turns_, t_s, {}, &Turn::begin_s);
  if (after == turns_.begin()) {
    return Quaterniond::Identity();
  }
  const Turn& last = *std::prev(after);
  if (t_s >= last.end_s) {
    return last.to;
  }
  const double u = (t_s - last.begin_s) / (last.end_s - last.begin_s);
  const double s = u * u * u * (10 + u * (6 * u - 15));
  return last.from * turn(s * last.rotation_vector_rad);
}

std::vector<Slew> imaging_slews(const ImagingProgramme& programme, double max_rate_rad_s,
                                double max_acceleration_rad_s2, double duration_s, Stream random) {
  std::vector<Slew> slews;
  double t = 0;
  while (true) {
    t += -programme.mean_rest_s * std::log(1 - random.uniform());
    if (!(t < duration_s)) {
      return slews;
    }
    Slew out{.begin_s = t};
    out.roll_rad = random.uniform(-programme.max_roll_rad, programme.max_roll_rad);
    out.pitch_rad = random.uniform(-programme.max_pitch_rad, programme.max_pitch_rad);
    const double angle = rotation_vector(slew_target(out)).norm();
    const double duration = turn_duration_s(angle, max_rate_rad_s, max_acceleration_rad_s2);
    // A microsecond keeps rounding from making neighbours overlap.
    const Slew back{.begin_s = t + duration + programme.dwell_s + 1e-6};
    slews.push_back(out);
    slews.push_back(back);
    t = back.begin_s + duration + 1e-6;
  }
}

// sinc¹²(x) = 1/2 at x = 0.1863; the mean over the phase of the sum of squared weights is the B-spline of degree 11 at
// its centre.
SmoothNoise::SmoothNoise(double bandwidth_hz, double begin_s, double end_s, Stream random)
    : begin_s_(begin_s), knots_per_s_(bandwidth_hz / 0.1863) {
  if (!(bandwidth_hz > 0)) {
    throw std::invalid_argument("jitter_bandwidth must be positive where there is jitter");
  }
  const double to_unit_variance = 1 / std::sqrt(655177.0 / 1663200.0);
  const auto intervals = static_cast<std::size_t>(std::ceil((end_s - begin_s) * knots_per_s_)) + 1;
  coefficients_.resize(intervals + 5);
  for (Vector3d& c : coefficients_) {
    check_stop();
    c = to_unit_variance * random.normal3();
  }
}

Vector3d SmoothNoise::at(double t_s) const {
  const double position = (t_s - begin_s_) * knots_per_s_;
  const auto last = static_cast<double>(coefficients_.size() - 6);
  const double interval = std::clamp(std::floor(position), 0.0, last);
  const double u = position - interval;
  const double v = 1 - u;
  const double u2 = u * u;
  const double v2 = v * v;
  const double u5 = u2 * u2 * u;
  const double v5 = v2 * v2 * v;
  // Weights of the uniform B-spline of degree 5, times 120; they are the same from both ends and sum to 120.
  const auto inner = [](double x) { return 1 + x * (5 + x * (10 + x * (10 + x * (5 - 5 * x)))); };
  const std::array<double, 6> w = {
      v5, inner(v), 66 + u2 * (-60 + u2 * (30 - 10 * u)), 66 + v2 * (-60 + v2 * (30 - 10 * v)), inner(u), u5};
  const Vector3d* c = &coefficients_[static_cast<std::size_t>(interval)];
  return (w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3] + w[4] * c[4] + w[5] * c[5]) / 120;
}

AttitudeSpline::AttitudeSpline(const std::vector<AttitudeSample>& samples) {
  if (samples.size() < 2) {
    throw std::invalid_argument("recorded attitude: needs at least two samples");
  }
  for (const AttitudeSample& sample : samples) {
    Vector4d q = sample.q_in_c.normalized().coeffs();
    if (!t_s_.empty()) {
      if (!(sample.t_s > t_s_.back())) {
        throw std::invalid_argument("recorded attitude: times must increase, see " + std::to_string(sample.t_s) + " s");
      }
      const double cosine = q.dot(q_.back());
      if (!(std::abs(cosine) > std::sqrt(0.5))) {
        throw std::invalid_argument("recorded attitude: jumps by 90 degrees or more at " + std::to_string(sample.t_s) +
                                    " s");
      }
      q *= std::copysign(1, cosine);
    }
    t_s_.push_back(sample.t_s);
    q_.push_back(q);
  }

  // Continuity of the first derivative: a tridiagonal system, solved by elimination and substitution.
  const std::size_t n = q_.size();
  q_second_.assign(n, Vector4d::Zero());
  std::vector<double> above(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double left = t_s_[i] - t_s_[i - 1];
    const double right = t_s_[i + 1] - t_s_[i];
    const Vector4d bend = (q_[i + 1] - q_[i]) / right - (q_[i] - q_[i - 1]) / left;
    const double pivot = 2 * (left + right) - left * above[i - 1];
    above[i] = right / pivot;
    q_second_[i] = (6 * bend - left * q_second_[i - 1]) / pivot;
  }
  for (std::size_t i = n - 2; i > 0; --i) {
    q_second_[i] -= above[i] * q_second_[i + 1];
  }
}

Quaterniond AttitudeSpline::at(double t_s) const {
  // Evenly spaced samples, the usual case, need no search.
  const auto last = static_cast<double>(t_s_.size() - 1);
  const double even = (t_s - t_s_.front()) / (t_s_.back() - t_s_.front()) * last;
  auto i = static_cast<std::size_t>(std::clamp(std::floor(even), 0.0, last - 1)) + 1;
  if (!(t_s_[i - 1] <= t_s && t_s < t_s_[i])) {
    i = static_cast<std::size_t>(std::upper_bound(t_s_.begin() + 1, t_s_.end() - 1, t_s) - t_s_.begin());
  }
  const double step = t_s_[i] - t_s_[i - 1];
  const double b = (t_s - t_s_[i - 1]) / step;
  const double a = 1 - b;
  const Vector4d q = a * q_[i - 1] + b * q_[i] +
                     step * step / 6 * ((a * a * a - a) * q_second_[i - 1] + (b * b * b - b) * q_second_[i]);
  return Quaterniond(Vector4d(q.normalized()));
}

AttitudeProgramme::AttitudeProgramme(const AttitudeScenario& scenario, const Ephemeris& ephemeris, std::uint64_t seed,
                                     double begin_s, double end_s)
    : AttitudeProgramme(scenario,
                        std::make_shared<AttitudeSpline>(reference_samples(scenario, ephemeris, begin_s, end_s)), seed,
                        begin_s, end_s) {}

AttitudeProgramme::AttitudeProgramme(const AttitudeScenario& scenario, std::shared_ptr<const AttitudeSpline> reference,
                                     std::uint64_t seed, double begin_s, double end_s)
    : reference_(std::move(reference)), jitter_rad_(scenario.jitter_rad) {
  // A recording may end with the pass. The body rate is evaluated a little beyond the end, where the spline still
  // holds.
  constexpr double kSlack_s = 0.2;
  if (!(reference_->begin_s() <= begin_s + kSlack_s && reference_->end_s() >= end_s - kSlack_s)) {
    throw std::invalid_argument("recorded attitude: must cover " + std::to_string(begin_s) + " … " +
                                std::to_string(end_s) + " s");
  }
  const double rate = scenario.max_slew_rate_rad_s;
  const double acceleration = scenario.max_slew_acceleration_rad_s2;
  if (const auto* programme = std::get_if<ImagingProgramme>(&scenario.slews)) {
    slews_ = SlewPlan(imaging_slews(*programme, rate, acceleration, end_s, Stream(seed, Source::kImaging)), rate,
                      acceleration);
  } else {
    slews_ = SlewPlan(std::get<std::vector<Slew>>(scenario.slews), rate, acceleration);
  }
  if (jitter_rad_ > 0) {
    jitter_.emplace(scenario.jitter_bandwidth_hz, begin_s, end_s, Stream(seed, Source::kJitter));
  }
}

Rot<In, C> AttitudeProgramme::at(double t_s) const {
  const Quaterniond steered = reference_->at(t_s) * slews_.at(t_s);
  return Rot<In, C>::assume(jitter_ ? steered * turn(jitter_rad_ * jitter_->at(t_s)) : steered);
}

Vec<C> AttitudeProgramme::rate(double t_s) const {
  // Central difference: 0.1 s apart rounding is 1e-15 rad/s and the curvature of a slew 1e-7 of its rate.
  constexpr double kHalf_s = 0.05;
  return (at(t_s - kHalf_s).inverse() * at(t_s + kHalf_s)).log() * (1 / (2 * kHalf_s));
}

}  // namespace trihedron::sim
