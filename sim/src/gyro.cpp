#include "trihedron/sim/gyro.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <type_traits>

#include "trihedron/sim/precession.hpp"
#include "trihedron/sim/two.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;

Esg7::Coefficients<double> initial_kappa(const DriftScenario& scenario, std::uint64_t seed, std::uint64_t gyro) {
  Esg7::Coefficients<double> kappa;
  Stream random(seed, Source::kKappa, gyro);
  for (int i = 0; i < Esg7::kSize; ++i) {
    kappa(i) = scenario.kappa_rad_s ? (*scenario.kappa_rad_s)[static_cast<std::size_t>(i)]
                                    : scenario.prior_sigma_rad_s * random.normal();
  }
  return kappa;
}

std::vector<DriftHarmonic> outside_members(const DriftScenario& scenario, std::uint64_t seed, std::uint64_t gyro) {
  std::vector<DriftHarmonic> members = scenario.harmonics;
  if (scenario.outside_sigma_rad_s > 0) {
    Stream random(seed, Source::kOutsideDrift, gyro);
    for (DriftHarmonic member : members_outside_eq1()) {
      member.amplitude_rad_s = scenario.outside_sigma_rad_s * random.normal();
      members.push_back(member);
    }
  }
  return members;
}

Rot<C, Case> true_alignment(const GyroScenario& scenario, std::uint64_t seed, std::uint64_t gyro) {
  const Vector3d misalignment = scenario.misalignment_rad.value_or(
      scenario.misalignment_magnitude_rad * Stream(seed, Source::kMisalignment, gyro).direction());
  return Rot<C, C>::exp(Vec<C>::assume(misalignment)) *
         Rot<C, Case>::exp(Vec<C>::assume(scenario.mounting_rotation_vector_rad));
}

Vec<C> start_direction(const GyroScenario& scenario) {
  const double length = scenario.start_direction_c.norm();
  if (!(length > 0 && std::isfinite(length))) {
    throw std::invalid_argument("gyro: the start direction must have a length");
  }
  return Vec<C>::assume(scenario.start_direction_c / length);
}

template <class S>
constexpr std::size_t kLanes = 1;
template <>
constexpr std::size_t kLanes<Two> = 2;

/// The matrices or vectors that `of` finds in each of the items, side by side.
template <class S, class Item, class Of>
auto of_each(std::span<Item> items, const Of& of) {
  using Raw = std::remove_cvref_t<decltype(of(items[0]))>;
  if constexpr (std::is_same_v<S, double>) {
    return Raw(of(items[0]));
  } else {
    return Eigen::Matrix<S, Raw::RowsAtCompileTime, Raw::ColsAtCompileTime>(
        of(items[0]).binaryExpr(of(items[1]), [](double first, double second) { return S(first, second); }));
  }
}

/// That of one of them.
template <class Raw>
auto of_lane(const Raw& all, std::size_t lane) {
  using One = Eigen::Matrix<double, Raw::RowsAtCompileTime, Raw::ColsAtCompileTime>;
  if constexpr (std::is_same_v<typename Raw::Scalar, double>) {
    return One(all);
  } else {
    return One(all.unaryExpr([lane](const Two& two) { return two[static_cast<int>(lane)]; }));
  }
}

}  // namespace

Drift::Drift(const DriftScenario& scenario, std::uint64_t seed, std::uint64_t gyro)
    : scenario_(scenario),
      kappa_rad_s_(initial_kappa(scenario, seed, gyro)),
      kappa_now_rad_s_(kappa_rad_s_ * (1 + scenario.warm_up_fraction)),
      field_(outside_members(scenario, seed, gyro)),
      coefficient_random_(seed, Source::kCoefficientWalk, gyro),
      walk_random_(seed, Source::kDirectionWalk, gyro),
      markov_random_(seed, Source::kMarkovDrift, gyro),
      jump_random_(seed, Source::kCoefficientJump, gyro) {
  if (scenario.markov_sigma_rad_s > 0) {
    markov_rad_s_ = scenario.markov_sigma_rad_s * markov_random_.normal3();
  }
  if (scenario.bump_rad_s != 0) {
    bump_.emplace(scenario.bump_rad_s,
                  scenario.bump_centre.value_or(Stream(seed, Source::kDriftBump, gyro).direction()),
                  scenario.bump_radius_rad);
  }
  if (scenario.hysteresis_rad_s != 0) {
    hysteresis_.emplace(scenario.hysteresis_rad_s, scenario.hysteresis_width_rad);
  }
  if (scenario.slew_fraction != 0 || scenario.polhode_fraction != 0 || scenario.thermal_fraction != 0) {
    modulation_.emplace(scenario, 2 * std::numbers::pi * Stream(seed, Source::kPolhode, gyro).uniform());
  }
  warm_up_ = scenario.warm_up_fraction;
}

void Drift::next_step(double t_s, double step_s, const Vec<Case>& h, const DriftModulation::Flight& flight) {
  if (scenario_.coefficient_walk_rad_s_sqrt_s > 0) {
    const double sigma = scenario_.coefficient_walk_rad_s_sqrt_s * std::sqrt(step_s);
    for (int i = 0; i < Esg7::kSize; ++i) {
      kappa_rad_s_(i) += sigma * coefficient_random_.normal();
    }
  }
  if (scenario_.jump_sigma_rad_s > 0 && !has_jumped_ && t_s >= scenario_.jump_at_s) {
    has_jumped_ = true;
    for (int i = 0; i < Esg7::kSize; ++i) {
      kappa_rad_s_(i) += scenario_.jump_sigma_rad_s * jump_random_.normal();
    }
  }
  if (scenario_.warm_up_fraction != 0) {
    warm_up_ = scenario_.warm_up_fraction * std::exp(-t_s / scenario_.warm_up_time_s);
  }
  if (modulation_) {
    modulation_->next_step(t_s, step_s, flight);
  }
  kappa_now_rad_s_ = kappa_rad_s_ * (1 + warm_up_ + (modulation_ ? modulation_->now() : 0));
  if (hysteresis_) {
    hysteresis_->move_to(h.raw());
  }
  if (scenario_.direction_walk_rad_sqrt_s > 0) {
    walk_rad_ = Vec<Case>::assume(scenario_.direction_walk_rad_sqrt_s * std::sqrt(step_s) * walk_random_.normal3());
  }
  if (scenario_.markov_sigma_rad_s > 0) {
    const double kept = std::exp(-step_s / scenario_.markov_time_s);
    markov_rad_s_ =
        kept * markov_rad_s_ + scenario_.markov_sigma_rad_s * std::sqrt(1 - kept * kept) * markov_random_.normal3();
  }
}

Esg7::Coefficients<double> Drift::part_in_eq1_rad_s() const {
  Esg7::Coefficients<double> part = kappa_rad_s_ * (1 + warm_up_ + (modulation_ ? modulation_->mean() : 0));
  // Members of other degrees are orthogonal to eq. (1); those drawn as outside of it are so, too.
  const auto may_be_in_eq1 = [](const DriftHarmonic& member) {
    return member.amplitude_rad_s != 0 && member.degree >= 2 && member.degree <= 4;
  };
  if (bump_ || std::ranges::any_of(scenario_.harmonics, may_be_in_eq1)) {
    part += part_in_eq1([this](const Vector3d& h) -> Vector3d {
      return field_.rate<double>(h) + (bump_ ? bump_->rate(h) : Vector3d(Vector3d::Zero()));
    });
  }
  return part;
}

Readout::Readout(const ReadoutScenario& scenario, Duration sample_period, std::uint64_t seed, int gyro)
    : scenario_(scenario),
      gyro_(gyro),
      stuck_samples_(static_cast<int>(std::lround(scenario.stuck_s / to_seconds(sample_period)))),
      noise_(seed, Source::kReadoutNoise, static_cast<std::uint64_t>(gyro)),
      dropout_(seed, Source::kReadoutDropout, static_cast<std::uint64_t>(gyro)),
      spike_(seed, Source::kReadoutSpike, static_cast<std::uint64_t>(gyro)),
      stuck_(seed, Source::kReadoutStuck, static_cast<std::uint64_t>(gyro)) {}

Vector3d Readout::read(Time t, const Vec<Case>& h, std::vector<Event>& events) {
  Vector3d reading = h.raw() + scenario_.scale.cwiseProduct(h.raw()) + scenario_.bias_rad;
  if (scenario_.noise_rad > 0) {
    reading += scenario_.noise_rad * noise_.normal3();
  }
  reading.normalize();
  if (scenario_.quantum_rad > 0) {
    reading = (reading / scenario_.quantum_rad).array().round().matrix() * scenario_.quantum_rad;
  }
  if (scenario_.spike_probability > 0 && spike_.happens(scenario_.spike_probability)) {
    const auto axis = static_cast<Eigen::Index>(spike_.bits() % 3);
    reading(axis) += spike_.uniform(-scenario_.spike_rad, scenario_.spike_rad);
    events.push_back({t, Fault::kReadoutSpike, gyro_});
  }
  if (scenario_.stuck_probability > 0) {
    if (stuck_left_ == 0 && stuck_.happens(scenario_.stuck_probability)) {
      stuck_left_ = stuck_samples_;
      last_ = reading;
    } else if (stuck_left_ > 0) {
      --stuck_left_;
      reading = last_;
      events.push_back({t, Fault::kReadoutStuck, gyro_});
    }
  }
  if (scenario_.dropout_probability > 0 && dropout_.happens(scenario_.dropout_probability)) {
    reading.setConstant(std::numeric_limits<double>::quiet_NaN());
    events.push_back({t, Fault::kReadoutDropout, gyro_});
  }
  return reading;
}

Gyro::Gyro(const GyroScenario& scenario, const Rot<In, C>& C_in_c, std::uint64_t seed, int gyro)
    : drift_(scenario.drift, seed, static_cast<std::uint64_t>(gyro)),
      mounting_change_(scenario.mounting_change),
      C_c_b_at_start_(true_alignment(scenario, seed, static_cast<std::uint64_t>(gyro))),
      C_c_b_(C_c_b_at_start_),
      C_in_b_(C_in_c * C_c_b_),
      h_in_(C_in_c * start_direction(scenario)),
      h_b_(C_in_b_.inverse() * h_in_) {}

void Gyro::advance(double t_s, double step_s, const Rot<In, C>& middle, const Rot<In, C>& end, bool sunlit) {
  advance_all({this, 1}, t_s, step_s, middle, end, sunlit);
}

void Gyro::advance_all(std::span<Gyro> gyros, double t_s, double step_s, const Rot<In, C>& middle,
                       const Rot<In, C>& end, bool sunlit) {
  for (Gyro& gyro : gyros) {
    gyro.begin_step(t_s, step_s, end, sunlit);
  }
  for (; gyros.size() >= 2; gyros = gyros.subspan(2)) {
    turn<Two>(gyros.first(2), step_s, middle, end);
  }
  if (!gyros.empty()) {
    turn<double>(gyros, step_s, middle, end);
  }
}

void Gyro::begin_step(double t_s, double step_s, const Rot<In, C>& end, bool sunlit) {
  DriftModulation::Flight flight{0, sunlit};
  if (drift_.is_modulated()) {
    flight.body_rate_rad_s = (C_in_b_.inverse() * (end * C_c_b_)).log().raw().norm() / step_s;
  }
  drift_.next_step(t_s, step_s, h_b_, flight);
  if (mounting_change_.is_there()) {
    C_c_b_ = Rot<C, C>::exp(Vec<C>::assume(mounting_change_.at(t_s + step_s))) * C_c_b_at_start_;
  }
}

template <class S>
void Gyro::turn(std::span<Gyro> gyros, double step_s, const Rot<In, C>& middle, const Rot<In, C>& end) {
  const Matrix3<S> C_c_b = of_each<S>(
      gyros, [](const Gyro& gyro) -> auto& { return gyro.C_c_b_.raw(); });
  const Matrix3<S> C_in_b[3] = {of_each<S>(
                                    gyros, [](const Gyro& gyro) -> auto& { return gyro.C_in_b_.raw(); }),
                                middle.raw().cast<S>() * C_c_b, end.raw().cast<S>() * C_c_b};
  const Vector3<S> h_in = of_each<S>(
      gyros, [](const Gyro& gyro) -> auto& { return gyro.h_in_.raw(); });
  const Vector3<S> h_b = of_each<S>(
      gyros, [](const Gyro& gyro) -> auto& { return gyro.h_b_.raw(); });
  const Esg7::Coefficients<S> kappa_rad_s = of_each<S>(
      gyros, [](const Gyro& gyro) -> auto& { return gyro.drift_.kappa_rad_s(); });
  const bool has_more = std::ranges::any_of(gyros, [](const Gyro& gyro) { return gyro.drift_.has_outside_eq1(); });
  const auto omega_in = [&](int stage, const Vector3<S>& h) -> Vector3<S> {
    const Vector3<S> now_b = stage == 0 ? h_b : Vector3<S>(C_in_b[stage].transpose() * h);
    if (!has_more) {
      return C_in_b[stage] * Esg7::rate<S>(now_b, kappa_rad_s);
    }
    std::array<Vector3d, kLanes<S>> rates;
    for (std::size_t i = 0; i < gyros.size(); ++i) {
      rates[i] = gyros[i].drift_.rate(Vec<Case>::assume(of_lane(now_b, i))).raw();
    }
    return C_in_b[stage] * of_each<S>(std::span<const Vector3d>(rates), std::identity());
  };
  const Vector3<S> turned = precess<S>(h_in, S(step_s), omega_in);
  for (std::size_t i = 0; i < gyros.size(); ++i) {
    Gyro& gyro = gyros[i];
    gyro.C_in_b_ = Rot<In, Case>::assume(of_lane(C_in_b[2], i));
    Vector3d h = of_lane(turned, i);
    if (gyro.drift_.walk()) {
      h = rotated<double>((gyro.C_in_b_ * *gyro.drift_.walk()).raw(), h);
    }
    gyro.h_in_ = Vec<In>::assume(h);
    gyro.h_b_ = gyro.C_in_b_.inverse() * gyro.h_in_;
  }
}

Truth::Gyro Gyro::truth() const {
  Truth::Gyro truth;
  const Esg7::Coefficients<double> part = drift_.part_in_eq1_rad_s();
  for (int i = 0; i < Esg7::kSize; ++i) {
    truth.drift_rad_s.emplace_back(DriftCoefficient::of_eq1(i), part(i));
  }
  for (const DriftHarmonic& member : drift_.outside().members()) {
    truth.unmodelled_rad_s.emplace_back(name(member), member.amplitude_rad_s);
  }
  truth.alignment_rotation_vector_rad = C_c_b_.log().raw();
  return truth;
}

}  // namespace trihedron::sim
