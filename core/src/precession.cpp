#include "trihedron/core/precession.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "trihedron/core/elementary.hpp"
#include "trihedron/core/lanes.hpp"

namespace trihedron {
namespace {

/// exp([v×]) u, as rotated().
Lanes3 rotated(const Lanes3& u, const Lanes3& v) {
  const Lanes angle2 = dot(v, v);
  Lanes a;
  Lanes b;
  for (int i = 0; i < 2; ++i) {
    const auto [its_a, its_b] = detail::rodrigues_coefficients(angle2[i]);
    a[i] = its_a;
    b[i] = its_b;
  }
  const Lanes3 c = cross(v, u);
  return u + a * c + b * cross(v, c);
}

/// As GyroReadout::corrected().
Lanes3 corrected(const PrecessingGyro& a, const PrecessingGyro& b) {
  const Lanes3 read = load3(a.h_b, b.h_b);
  const Lanes3 bias = load3(a.readout_bias, b.readout_bias);
  return read - (bias - dot(read, bias) * read);
}

/// m times v, m by its columns.
Lanes3 product(const Lanes3 (&m)[3], const Lanes3& v) {
  return {m[0].x * v.x + (m[1].x * v.y + m[2].x * v.z), m[0].y * v.x + (m[1].y * v.y + m[2].y * v.z),
          m[0].z * v.x + (m[1].z * v.y + m[2].z * v.z)};
}

[[gnu::always_inline]] inline void turn_momenta(const PrecessingGyro& a, const PrecessingGyro& b, const Lanes3& turn) {
  const Lanes3 h = rotated(load3(a.h_in, b.h_in), turn);
  store3((2.0 - (0.5 + 0.5 * dot(h, h))) * h, a.h_in, b.h_in);  // as kept_unit()
}

/// Of two gyros with eq. (1): its columns at their readings, and the turn that they make. `given`: the rates, or null
/// where eq. (1) makes them.
struct TurnOfTwo {
  Lanes3 k0;
  Lanes x_mu12, y_mu12, y_mu23, z_mu23, x_mu31, z_mu31;
  Lanes x_nu23, y_nu31, z_nu12;
  Lanes3 m[3];  ///< columns of dt C_in_b
  Lanes3 turn;

  [[gnu::always_inline]] TurnOfTwo(const PrecessingGyro& a, const PrecessingGyro& b, const Eigen::Matrix3d& C_in_c,
                                   double dt_s, const Lanes3* given) {
    const Lanes3 h = corrected(a, b);
    // The columns of eq. (1) that are not zero.
    const Lanes sx = h.x * h.x, sy = h.y * h.y, sz = h.z * h.z;
    const Lanes qx = sx * sx, qy = sy * sy, qz = sz * sz;
    k0 = {h.x * (qx - sx + qy + qz), h.y * (qy - sy + qz + qx), h.z * (qz - sz + qx + qy)};
    x_mu12 = h.x * sy, y_mu12 = -h.y * sx;
    y_mu23 = h.y * sz, z_mu23 = -h.z * sy;
    x_mu31 = -h.x * sz, z_mu31 = h.z * sx;
    z_nu12 = h.x * h.y, x_nu23 = h.y * h.z, y_nu31 = h.z * h.x;

    const Eigen::Matrix3d dt_C = dt_s * C_in_c;
    for (int j = 0; j < 3; ++j) {
      const Lanes3 alignment = load3(a.C_c_b + 3L * j, b.C_c_b + 3L * j);
      Lanes column[3];
      for (int i = 0; i < 3; ++i) {
        const Lanes3 row{both_lanes(dt_C(i, 0)), both_lanes(dt_C(i, 1)), both_lanes(dt_C(i, 2))};
        column[i] = dot(row, alignment);
      }
      m[j] = {column[0], column[1], column[2]};
    }
    Lanes3 rate;
    if (given != nullptr) {
      rate = *given;
    } else {
      const auto kappa = [&](int i) { return load(a.kappa + i, b.kappa + i); };
      rate = kappa(Esg7::kK0) * k0;
      rate = {0.0 + rate.x, 0.0 + rate.y, 0.0 + rate.z};  // a zero without sign, as the sum that begins with one
      rate.x = rate.x + x_mu12 * kappa(Esg7::kMu12) + x_mu31 * kappa(Esg7::kMu31) + x_nu23 * kappa(Esg7::kNu23);
      rate.y = rate.y + y_mu12 * kappa(Esg7::kMu12) + y_mu23 * kappa(Esg7::kMu23) + y_nu31 * kappa(Esg7::kNu31);
      rate.z = rate.z + z_mu23 * kappa(Esg7::kMu23) + z_mu31 * kappa(Esg7::kMu31) + z_nu12 * kappa(Esg7::kNu12);
    }
    turn = product(m, rate);
  }

  /// work(i, dt C_in_b times the column i of eq. (1)) for all of them.
  template <class Work>
  [[gnu::always_inline]] void for_columns(const Work& work) const {
    work(Esg7::kK0, k0.x * m[0] + k0.y * m[1] + k0.z * m[2]);
    work(Esg7::kMu12, x_mu12 * m[0] + y_mu12 * m[1]);
    work(Esg7::kMu23, y_mu23 * m[1] + z_mu23 * m[2]);
    work(Esg7::kMu31, x_mu31 * m[0] + z_mu31 * m[2]);
    work(Esg7::kNu12, z_nu12 * m[2]);
    work(Esg7::kNu23, x_nu23 * m[0]);
    work(Esg7::kNu31, y_nu31 * m[1]);
  }
};

/// precess_two() with sensitivities.
[[gnu::always_inline]] inline void precess_two(const PrecessingGyro& a, const PrecessingGyro& b,
                                               const SensitivityOfEq1& since_a, const SensitivityOfEq1& since_b,
                                               const Eigen::Matrix3d& C_in_c, double dt_s, const Lanes3* given) {
  const TurnOfTwo its(a, b, C_in_c, dt_s, given);
  const Lanes3& turn = its.turn;
  turn_momenta(a, b, turn);

  for (int j = 0; j < 3; ++j) {
    const Lanes3 phi = load3(since_a.by_start + 3L * j, since_b.by_start + 3L * j);
    store3(phi + cross(turn, phi), since_a.by_start + 3L * j, since_b.by_start + 3L * j);
    const Lanes3 by_alignment = load3(since_a.by_alignment + 3L * j, since_b.by_alignment + 3L * j);
    const Lanes3 C{both_lanes(C_in_c(0, j)), both_lanes(C_in_c(1, j)), both_lanes(C_in_c(2, j))};
    store3(by_alignment + cross(turn, by_alignment - C), since_a.by_alignment + 3L * j, since_b.by_alignment + 3L * j);
  }
  its.for_columns([&](int column, const Lanes3& added) {
    double* const x[2] = {since_a.by_drift.row(0) + column, since_b.by_drift.row(0) + column};
    double* const y[2] = {since_a.by_drift.row(1) + column, since_b.by_drift.row(1) + column};
    double* const z[2] = {since_a.by_drift.row(2) + column, since_b.by_drift.row(2) + column};
    const Lanes3 phi{load(x[0], x[1]), load(y[0], y[1]), load(z[0], z[1])};
    const Lanes3 next = phi + cross(turn, phi) + added;
    store(next.x, x[0], x[1]);
    store(next.y, y[0], y[1]);
    store(next.z, z[0], z[1]);
  });
}

/// Of two vectors side by side whose components lie one after the other.
[[gnu::always_inline]] inline void add_to(double* sum, const Lanes3& its) {
  store2(load2(sum) + its.x, sum);
  store2(load2(sum + 2) + its.y, sum + 2);
  store2(load2(sum + 4) + its.z, sum + 4);
}

}  // namespace

/// The work of precess_two() by sums, inlined into functions for any processor and for AVX2, whose instructions have a
/// place of their own for the result: the same bits with a fifth fewer.
struct PrecessingTwo {
  [[gnu::always_inline]] static bool step(const PrecessingGyro& a, const PrecessingGyro& b, StepsOfTwo& steps,
                                          const Eigen::Matrix3d& C_in_c, double dt_s) {
    const TurnOfTwo its(a, b, C_in_c, dt_s, nullptr);
    const double* so_far = steps.at(StepsOfTwo::kTurn);
    const Lanes3 turn = Lanes3{load2(so_far), load2(so_far + 2), load2(so_far + 4)} + its.turn;
    const Lanes square = dot(turn, turn);
    constexpr double kMostSquare = StepsOfTwo::kMostTurn_rad * StepsOfTwo::kMostTurn_rad;
    if (steps.steps_ == StepsOfTwo::kMost || !(square[0] < kMostSquare && square[1] < kMostSquare)) {
      return false;
    }
    // exp([t×]) h for so small a t, to 2e-16. Its length is left as it is until the next correction: what rounding adds
    // to it in a day without fixes is 1e-11.
    const Lanes3 h = load3(a.h_in, b.h_in);
    const Lanes3 moved = cross(its.turn, h);
    store3(h + (moved + both_lanes(0.5) * cross(its.turn, moved)), a.h_in, b.h_in);
    ++steps.steps_;
    add_to(steps.at(StepsOfTwo::kTurn), its.turn);
    for (int j = 0; j < 3; ++j) {
      const Lanes3 C{both_lanes(C_in_c(0, j)), both_lanes(C_in_c(1, j)), both_lanes(C_in_c(2, j))};
      add_to(steps.at(StepsOfTwo::kAlignment + j), cross(C, its.turn));
    }
    its.for_columns([&](int column, const Lanes3& added) { add_to(steps.at(StepsOfTwo::kDrift + column), added); });
    return true;
  }
};

#ifdef __x86_64__
namespace {
[[gnu::target("avx2")]] bool precess_two_by_avx(const PrecessingGyro& a, const PrecessingGyro& b, StepsOfTwo& steps,
                                                const Eigen::Matrix3d& C_in_c, double dt_s) {
  return PrecessingTwo::step(a, b, steps, C_in_c, dt_s);
}
}  // namespace
#endif

void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const Eigen::Matrix3d& C_in_c, double dt_s) {
  const Lanes3 h = corrected(a, b);
  Esg7::Coefficients<Lanes> kappa;
  for (int i = 0; i < Esg7::kSize; ++i) {
    kappa(i) = load(a.kappa + i, b.kappa + i);
  }
  const Vector3<Lanes> rate = Esg7::rate<Lanes>({h.x, h.y, h.z}, kappa);
  Lanes3 alignment[3];
  Lanes3 attitude[3];
  for (int j = 0; j < 3; ++j) {
    alignment[j] = load3(a.C_c_b + 3L * j, b.C_c_b + 3L * j);
    attitude[j] = {both_lanes(C_in_c(0, j)), both_lanes(C_in_c(1, j)), both_lanes(C_in_c(2, j))};
  }
  const Lanes3 omega_in = product(attitude, product(alignment, {0.0 + rate(0), 0.0 + rate(1), 0.0 + rate(2)}));
  turn_momenta(a, b, both_lanes(dt_s) * omega_in);
}

void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const SensitivityOfEq1& since_a,
                 const SensitivityOfEq1& since_b, const Eigen::Matrix3d& C_in_c, double dt_s) {
  precess_two(a, b, since_a, since_b, C_in_c, dt_s, nullptr);
}

bool precess_two(const PrecessingGyro& a, const PrecessingGyro& b, StepsOfTwo& steps, const Eigen::Matrix3d& C_in_c,
                 double dt_s) {
#ifdef __x86_64__
  if (static_cast<int>(__builtin_cpu_supports("avx2")) != 0) {
    return precess_two_by_avx(a, b, steps, C_in_c, dt_s);
  }
#endif
  return PrecessingTwo::step(a, b, steps, C_in_c, dt_s);
}

void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const SensitivityOfEq1& since_a,
                 const SensitivityOfEq1& since_b, const Eigen::Matrix3d& C_in_c, double dt_s,
                 const Eigen::Vector3d& rate_a, const Eigen::Vector3d& rate_b) {
  const Lanes3 rates = load3(rate_a.data(), rate_b.data());
  precess_two(a, b, since_a, since_b, C_in_c, dt_s, &rates);
}

void advance_by_drift(ColumnsView by_drift, ColumnsView basis, const Eigen::Matrix3d& dt_C_in_b,
                      const Eigen::Vector3d& turn) {
  // One plain loop over all columns, which the compiler makes vector instructions of.
  double* __restrict x = by_drift.row(0);
  double* __restrict y = by_drift.row(1);
  double* __restrict z = by_drift.row(2);
  const double* __restrict bx = basis.row(0);
  const double* __restrict by = basis.row(1);
  const double* __restrict bz = basis.row(2);
  const double tx = turn.x();
  const double ty = turn.y();
  const double tz = turn.z();
  const Eigen::Matrix3d& m = dt_C_in_b;
  const double m00 = m(0, 0), m01 = m(0, 1), m02 = m(0, 2);
  const double m10 = m(1, 0), m11 = m(1, 1), m12 = m(1, 2);
  const double m20 = m(2, 0), m21 = m(2, 1), m22 = m(2, 2);
  const int columns = ColumnsView::padded(by_drift.columns);
#ifndef __clang__
#pragma GCC ivdep  // the rows do not overlap
#endif
  for (int i = 0; i < columns; ++i) {
    const double px = x[i];
    const double py = y[i];
    const double pz = z[i];
    x[i] = px + (ty * pz - tz * py) + (m00 * bx[i] + m01 * by[i] + m02 * bz[i]);
    y[i] = py + (tz * px - tx * pz) + (m10 * bx[i] + m11 * by[i] + m12 * bz[i]);
    z[i] = pz + (tx * py - ty * px) + (m20 * bx[i] + m21 * by[i] + m22 * bz[i]);
  }
}

Eigen::Matrix3d turned(const Eigen::Matrix3d& C_c_b, const Eigen::Vector3d& delta) {
  return Eigen::Quaterniond(Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * C_c_b).normalized().toRotationMatrix();
}

double GaussMarkov::kept(double dt_s) const { return std::max(elementary::exp(-dt_s / time_s), 1e-6); }

double GaussMarkov::noise(double kept) const { return sigma * std::sqrt(1 - kept * kept); }

double CourseOfChange::since_begin(Time t) const {
  const double after_s = std::max(to_seconds(t - begin), 0.0);
  if (kind == Kind::kJump) {
    return after_s < time_s ? 0 : 1;
  }
  return (1 - elementary::exp(-after_s / time_s)) / (1 - elementary::exp(-duration_s / time_s));
}

double CourseOfChange::part(Time t) const {
  return kind == Kind::kEven ? to_seconds(t - zero_at) / duration_s : since_begin(t) - since_begin(zero_at);
}

double CourseOfChange::mean_part(Time from, Time to) const {
  if (kind != Kind::kJump) {
    return part(from + (to - from) / 2);
  }
  const double after_s = to_seconds(to - begin) - time_s;
  return std::clamp(after_s / to_seconds(to - from), 0.0, 1.0) - since_begin(zero_at);
}

double Polhode::angle_rad(double since_s) const {
  const auto period = static_cast<double>(period_s);
  const auto rate = static_cast<double>(period_rate);
  // ∫ dt / period = ln(1 + x) / rate, x the relative change of the period; ln(1 + x) = 2 artanh z, z = x / (2 + x).
  const double x = std::clamp(rate * since_s / period, -0.5, 1.0);
  const double changing_s = rate == 0 ? since_s : x * period / rate;
  const double z = x / (2 + x);
  double series = 0;
  for (int n = 33; n > 0; n -= 2) {
    series = series * z * z + 1.0 / n;
  }
  const double turns = changing_s * 2 / (2 + x) * series / period + (since_s - changing_s) / (period * (1 + x));
  return 2 * std::numbers::pi * turns;
}

double missed_by_long_step_rad(double drift_rad, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double dt_s) {
  const double turn_rad = dt_s < kQuarterOrbit_s ? angle_between<double>(from, to) : std::numbers::pi;
  return drift_rad * turn_rad;
}

}  // namespace trihedron
