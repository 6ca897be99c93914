#include "trihedron/sim/star_tracker.hpp"

#include <erfa.h>
#include <erfam.h>

#include <cmath>
#include <optional>

#include "trihedron/records/stop.hpp"
#include "trihedron/sim/interval.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The error that depends on which stars are in the field of view: Gauss–Markov in the angle by which the field has
/// moved over the sky.
class FieldError {
 public:
  FieldError(const StarTrackerScenario& head, Stream random) : head_(head), random_(random), unit_(random_.normal3()) {}

  [[nodiscard]] Vector3d after_move(double angle_rad) {
    const double kept = std::exp(-angle_rad / head_.field_correlation_rad);
    unit_ = kept * unit_ + std::sqrt(1 - kept * kept) * random_.normal3();
    return head_.field_error_rad.cwiseProduct(unit_);
  }

 private:
  const StarTrackerScenario& head_;
  Stream random_;
  Vector3d unit_;
};

/// The fault that keeps the head from giving a fix at this attitude and time, if any.
std::optional<Fault> obstacle(const StarTrackerScenario& head, const StarTrackerView& view, const Rot<C, Head>& C_c_s,
                              double t_s) {
  if (std::isfinite(head.max_rate_rad_s) && !(view.attitude.rate(t_s).norm() <= head.max_rate_rad_s)) {
    return Fault::kFixTooFast;
  }
  if (head.sun_exclusion_rad || head.earth_exclusion_rad) {
    const Vector3d boresight = (view.attitude.at(t_s) * C_c_s).raw().col(2);
    const Vector3d from_earth = view.ephemeris.at(t_s).position_m.raw();
    if (head.sun_exclusion_rad &&
        angle_between<double>(boresight, view.sky.at(t_s).sun_m.raw() - from_earth) < *head.sun_exclusion_rad) {
      return Fault::kFixSunBlinded;
    }
    const double earth_radius = std::asin(kEarthRadius_m / from_earth.norm());
    if (head.earth_exclusion_rad &&
        angle_between<double>(boresight, -from_earth) < earth_radius + *head.earth_exclusion_rad) {
      return Fault::kFixEarthBlinded;
    }
  }
  return std::nullopt;
}

}  // namespace

Vec<Head> aberration_error(const Rot<In, Head>& C_in_s, const Vec<In>& velocity_m_s) {
  Vector3d star = C_in_s.raw().col(2);
  Vector3d beta = velocity_m_s.raw() / ERFA_CMPS;
  Vector3d seen;
  // The Sun's gravity moves a star by 0.4 mas at most. It is left out by giving a distance of 1e9 au from the Sun.
  eraAb(star.data(), beta.data(), 1e9, std::sqrt(1 - beta.squaredNorm()), seen.data());
  // The head reports the attitude at which its catalogue would be seen like this: turned against the displacement.
  return C_in_s.inverse() * Vec<In>::assume(-star.cross(seen));
}

StarTrackerTelemetry simulate_fixes(const StarTrackerScenario& head, const StarTrackerView& view, Time epoch,
                                    Duration duration, Duration period, std::uint64_t seed, std::vector<Event>& events,
                                    int head_number) {
  const auto head_index = static_cast<std::uint64_t>(head_number);
  const auto tell = [&](Time t, Fault fault) { events.push_back({t, fault, -1, head_number}); };
  Stream noise(seed, Source::kTrackerNoise, head_index);
  Stream dropout(seed, Source::kTrackerDropout, head_index);
  Stream outlier(seed, Source::kTrackerOutlier, head_index);
  Stream sign(seed, Source::kTrackerSign, head_index);
  FieldError field(head, Stream(seed, Source::kTrackerField, head_index));
  const double n = view.ephemeris.mean_rate_rad_s();
  const auto C_c_s_designed = Rot<C, Head>::exp(Vec<C>::assume(head.mounting_rotation_vector_rad));
  const Rot<C, Head> C_c_s = Rot<C, C>::exp(Vec<C>::assume(head.misalignment_rad)) * C_c_s_designed;

  StarTrackerTelemetry fixes;
  Quaterniond previous = Quaterniond::Identity();
  for (Duration since{0}; since <= duration; since += period) {
    check_stop();
    const Time t = epoch + since;
    const double t_s = to_seconds(since) * (1 + head.clock_rate) + head.clock_offset_s - head.latency_s;
    const double phase = n * to_seconds(since);

    // Every random number of a fix is drawn whether it is used or not, so that switching a fault on changes no other
    // fix.
    Vector3d error = head.noise_rad.cwiseProduct(noise.normal3());
    error += head.orbital_sine_rad * std::sin(phase) + head.orbital_cosine_rad * std::cos(phase);
    if (!head.field_error_rad.isZero(0)) {
      error += field.after_move(view.attitude.rate(t_s).norm() * to_seconds(period));
    }
    const double gross_rad = outlier.uniform(0, head.outlier_rad);
    const Vector3d gross = gross_rad * outlier.direction();
    const bool is_outlier = outlier.happens(head.outlier_probability);
    const bool is_wrong_sign = sign.happens(head.wrong_sign_probability);
    const bool is_dropped = dropout.happens(head.dropout_probability);

    if (within(head.outages, since)) {
      tell(t, Fault::kFixOutage);
      continue;
    }
    if (const std::optional<Fault> why = obstacle(head, view, C_c_s, t_s)) {
      tell(t, *why);
      continue;
    }
    if (is_dropped) {
      tell(t, Fault::kFixDropout);
      continue;
    }

    error += head.mounting_change.at(t_s);
    const Rot<In, Head> truth = view.attitude.at(t_s) * C_c_s;
    if (head.aberration == StarTrackerScenario::Aberration::kUncorrected) {
      error += aberration_error(truth, view.ephemeris.at(t_s).velocity_m_s + view.sky.at(t_s).earth_velocity_m_s).raw();
    }
    Rot<In, Head> measured = truth * Rot<Head, Head>::exp(Vec<Head>::assume(error));
    if (is_outlier) {
      measured = measured * Rot<Head, Head>::exp(Vec<Head>::assume(gross));
      tell(t, Fault::kFixOutlier);
    }
    if (t_s >= head.inertial_step_at_s && !head.inertial_step_rad.isZero(0)) {
      measured = Rot<In, In>::exp(Vec<In>::assume(head.inertial_step_rad)) * measured;
    }
    Quaterniond q = (measured * C_c_s_designed.inverse()).quaternion();
    if (q.dot(previous) < 0) {
      q.coeffs() = -q.coeffs();
    }
    previous = q;
    if (is_wrong_sign) {
      q.coeffs() = -q.coeffs();
      tell(t, Fault::kFixWrongSign);
    }
    fixes.t.push_back(t);
    fixes.q_in_c.push_back(q);
  }
  return fixes;
}

}  // namespace trihedron::sim
