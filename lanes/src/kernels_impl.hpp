// Included once by each source that compiles it for a kind of processor, which TRIHEDRON_LANES_PROCESSOR names. Nothing
// but state.hpp and functions of this file may be called here: an inline function of a library, compiled for AVX-512,
// could be linked into what runs on any processor.

#include "kernels.hpp"

#define TRIHEDRON_INLINE [[gnu::always_inline]] static inline

namespace trihedron::lanes::TRIHEDRON_LANES_PROCESSOR {
namespace {

// ---- Numbers

using Mask = decltype(V{} < V{});
using Floats = float __attribute__((vector_size(4 * kWidth)));

TRIHEDRON_INLINE V all(double value) { return V{} + value; }
TRIHEDRON_INLINE V select(Mask where, V yes, V no) { return where ? yes : no; }
TRIHEDRON_INLINE V larger(V a, V b) { return select(a > b, a, b); }
TRIHEDRON_INLINE V smaller(V a, V b) { return select(a < b, a, b); }
TRIHEDRON_INLINE V root(V a) {
  V result;
  for (int i = 0; i < kWidth; ++i) {
    result[i] = __builtin_sqrt(a[i]);
  }
  return result;
}
TRIHEDRON_INLINE bool any(Mask mask) {
  long long found = 0;
  for (int i = 0; i < kWidth; ++i) {
    found |= mask[i];
  }
  return found != 0;
}
/// To single precision and back.
TRIHEDRON_INLINE V as_float(V a) { return __builtin_convertvector(__builtin_convertvector(a, Floats), V); }
/// The difference of two numbers of single precision, in single precision.
TRIHEDRON_INLINE V float_difference(V a, V b) {
  return __builtin_convertvector(__builtin_convertvector(a, Floats) - __builtin_convertvector(b, Floats), V);
}

TRIHEDRON_INLINE V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
TRIHEDRON_INLINE V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
TRIHEDRON_INLINE V3 operator*(V s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }
TRIHEDRON_INLINE V dot(const V3& a, const V3& b) { return a.x * b.x + (a.y * b.y + a.z * b.z); }
TRIHEDRON_INLINE V3 cross(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
TRIHEDRON_INLINE V3 unit(const V3& a) { return (1 / root(dot(a, a))) * a; }
TRIHEDRON_INLINE V3 times(const V3& a, const V3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
TRIHEDRON_INLINE V3 zero3() { return {V{}, V{}, V{}}; }
/// Unit vector of an axis.
TRIHEDRON_INLINE V3 axis(int i) { return {all(i == 0 ? 1 : 0), all(i == 1 ? 1 : 0), all(i == 2 ? 1 : 0)}; }

TRIHEDRON_INLINE V3 operator*(const M3& m, const V3& v) {
  return v.x * m.column[0] + (v.y * m.column[1] + v.z * m.column[2]);
}
TRIHEDRON_INLINE V3 transposed_times(const M3& m, const V3& v) {
  return {dot(m.column[0], v), dot(m.column[1], v), dot(m.column[2], v)};
}
TRIHEDRON_INLINE M3 operator*(const M3& a, const M3& b) {
  return {{a * b.column[0], a * b.column[1], a * b.column[2]}};
}
TRIHEDRON_INLINE M3 transposed(const M3& m) {
  const V3& a = m.column[0];
  const V3& b = m.column[1];
  const V3& c = m.column[2];
  return {{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}};
}
TRIHEDRON_INLINE M3 inverse(const M3& m) {
  const V3 x = cross(m.column[1], m.column[2]);
  const V3 y = cross(m.column[2], m.column[0]);
  const V3 z = cross(m.column[0], m.column[1]);
  const V by = 1 / dot(m.column[0], x);
  return transposed({{by * x, by * y, by * z}});
}
TRIHEDRON_INLINE V trace(const M3& m) { return m.column[0].x + m.column[1].y + m.column[2].z; }

/// exp([turn×]) v, core/frames.hpp; of more than 0.05 rad less exact.
TRIHEDRON_INLINE V3 rotated(const V3& v, const V3& turn) {
  const V angle2 = dot(turn, turn);
  const V a = 1 - angle2 * (1.0 / 6) * (1 - angle2 * (1.0 / 20) * (1 - angle2 * (1.0 / 42)));
  const V b = 0.5 - angle2 * (1.0 / 24) * (1 - angle2 * (1.0 / 30) * (1 - angle2 * (1.0 / 56)));
  const V3 once = cross(turn, v);
  return v + a * once + b * cross(turn, once);
}
/// The same of a turn by less than kLittle_rad, as in a step: what is left out is below rounding.
TRIHEDRON_INLINE V3 rotated_by_little(const V3& v, const V3& turn) {
  const V3 once = cross(turn, v);
  return v + once + all(0.5) * cross(turn, once);
}
/// The rotation vector of a rotation by little: exact to rounding up to 0.02 rad.
TRIHEDRON_INLINE V3 rotation_vector(const M3& m) {
  const V3 sine = {0.5 * (m.column[1].z - m.column[2].y), 0.5 * (m.column[2].x - m.column[0].z),
                   0.5 * (m.column[0].y - m.column[1].x)};
  const V square = dot(sine, sine);
  return (1 + square * (1.0 / 6 + square * (3.0 / 40 + square * (5.0 / 112)))) * sine;
}

// ---- The body and its gyros as they are

TRIHEDRON_INLINE Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.v + b.w * a.v + cross(a.v, b.v), a.w * b.w - dot(a.v, b.v)};
}

/// Of half a rotation vector of up to a right angle: Taylor's series to rounding.
TRIHEDRON_INLINE Quaternion turn_of_half(const V3& half) {
  // Of cos and of sin x / x: those of each power of −x².
  constexpr double kCosine[] = {1.0,
                                0x1p-1,
                                1.0 / 24,
                                1.0 / 720,
                                1.0 / 40320,
                                1.0 / 3628800,
                                1.0 / 479001600,
                                1.0 / 87178291200,
                                1.0 / 20922789888000,
                                1.0 / 6402373705728000,
                                1.0 / 2432902008176640000,
                                1.0 / 1.12400072777760768e21};
  constexpr int kLast = 11;
  const V x = V{} - dot(half, half);
  V cosine = all(kCosine[kLast]);
  V sinc = all(kCosine[kLast] / (2 * kLast + 1));
#pragma GCC unroll 16
  for (int i = kLast - 1; i >= 0; --i) {
    cosine = kCosine[i] + x * cosine;
    sinc = kCosine[i] / (2 * i + 1) + x * sinc;
  }
  return {sinc * half, cosine};
}
/// The same of a very small one.
TRIHEDRON_INLINE Quaternion small_turn_of_half(const V3& half) {
  const V x = dot(half, half);
  return {(1 + x * (-1.0 / 6 + x * (1.0 / 120))) * half, 1 + x * (-1.0 / 2 + x * (1.0 / 24 - x * (1.0 / 720)))};
}

TRIHEDRON_INLINE int interval_of(double position, int last) {
  const int interval = static_cast<int>(position);
  return interval < 0 ? 0 : interval > last ? last : interval;
}

/// Of the ends of an interval of a cubic spline, and of the second derivatives there; `b`: the part of it that is past.
template <class S>
struct SplineWeights {
  S a, b, a3, b3;
};
template <class S>
TRIHEDRON_INLINE SplineWeights<S> spline_weights(S b, S spacing_s) {
  const S a = 1 - b;
  const S by_second = spacing_s * spacing_s * (1.0 / 6);
  return {a, b, by_second * (a * a * a - a), by_second * (b * b * b - b)};
}

/// Of six coefficients of a B-spline of degree 5.
constexpr int kKnots = 6;
template <class S>
TRIHEDRON_INLINE void put_spline_weights(S u, S (&w)[kKnots]) {
  const S v = 1 - u;
  const S u2 = u * u;
  const S v2 = v * v;
  const auto inner = [](S x) { return 1 + x * (5 + x * (10 + x * (10 + x * (5 - 5 * x)))); };
  w[0] = (1.0 / 120) * (v2 * v2 * v);
  w[1] = (1.0 / 120) * inner(v);
  w[2] = (1.0 / 120) * (66 + u2 * (-60 + u2 * (30 - 10 * u)));
  w[3] = (1.0 / 120) * (66 + v2 * (-60 + v2 * (30 - 10 * v)));
  w[4] = (1.0 / 120) * inner(u);
  w[5] = (1.0 / 120) * (u2 * u2 * u);
}

TRIHEDRON_INLINE Quaternion reference_at(const Attitude& its, double t_s) {
  const int last = its.node_count - 2;
  V q[4];
  if (its.is_together) {
    const double position = (t_s - its.begin_s[0]) / its.spacing_s[0];
    const int interval = interval_of(position, last);
    const SplineWeights<double> w = spline_weights<double>(position - interval, its.spacing_s[0]);
    const SplineNode* nodes = its.nodes + interval;
    for (int k = 0; k < 4; ++k) {
      q[k] =
          w.a * nodes[0].value[k] + w.b * nodes[1].value[k] + (w.a3 * nodes[0].second[k] + w.b3 * nodes[1].second[k]);
    }
  } else {
    V position = (t_s - its.begin_s) / its.spacing_s;
    SplineNode nodes[2];
    for (int i = 0; i < kWidth; ++i) {
      const int interval = interval_of(position[i], last);
      position[i] -= interval;
      for (int end = 0; end < 2; ++end) {
        for (int k = 0; k < 4; ++k) {
          nodes[end].value[k][i] = its.nodes[interval + end].value[k][i];
          nodes[end].second[k][i] = its.nodes[interval + end].second[k][i];
        }
      }
    }
    const SplineWeights<V> w = spline_weights<V>(position, its.spacing_s);
    for (int k = 0; k < 4; ++k) {
      q[k] =
          w.a * nodes[0].value[k] + w.b * nodes[1].value[k] + (w.a3 * nodes[0].second[k] + w.b3 * nodes[1].second[k]);
    }
  }
  const V by = 1 / root((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  return {{by * q[0], by * q[1], by * q[2]}, by * q[3]};
}

/// sim::SmoothNoise.
TRIHEDRON_INLINE V3 jitter_at(const Attitude& its, double t_s) {
  const int last = its.jitter_count - kKnots;
  V3 sum = zero3();
  if (its.is_together) {
    const double position = (t_s - its.jitter_begin_s[0]) * its.jitter_knots_per_s;
    const int interval = interval_of(position, last);
    double w[kKnots];
    put_spline_weights<double>(position - interval, w);
    for (int k = 0; k < kKnots; ++k) {
      sum = sum + all(w[k]) * its.jitter[interval + k];
    }
  } else {
    V position = (t_s - its.jitter_begin_s) * its.jitter_knots_per_s;
    V3 coefficients[kKnots];
    for (int i = 0; i < kWidth; ++i) {
      const int interval = interval_of(position[i], last);
      position[i] -= interval;
      for (int k = 0; k < kKnots; ++k) {
        const V3& of_flight = its.jitter[interval + k];
        coefficients[k].x[i] = of_flight.x[i];
        coefficients[k].y[i] = of_flight.y[i];
        coefficients[k].z[i] = of_flight.z[i];
      }
    }
    V w[kKnots];
    put_spline_weights<V>(position, w);
    for (int k = 0; k < kKnots; ++k) {
      sum = sum + w[k] * coefficients[k];
    }
  }
  return its.jitter_rad * sum;
}

void attitude(const Attitude& its, double t_s, M3& C_in_c) {
  const V since = (t_s - its.turn_begin_s) * its.turns_per_s;
  const V u = smaller(larger(since, V{}), all(1));
  const V s = u * u * u * (10 + u * (6 * u - 15));
  Quaternion q = reference_at(its, t_s) * (its.turn_from * turn_of_half(0.5 * s * its.turn_rad));
  if (its.jitter != nullptr) {
    q = q * small_turn_of_half(all(0.5) * jitter_at(its, t_s));
  }
  const V3& v = q.v;
  const V3 twice = v + v;
  const V3 wv = q.w * twice;
  const V xx = v.x * twice.x;
  const V yy = v.y * twice.y;
  const V zz = v.z * twice.z;
  const V xy = v.x * twice.y;
  const V xz = v.x * twice.z;
  const V yz = v.y * twice.z;
  C_in_c = {{{1 - (yy + zz), xy + wv.z, xz - wv.y},
             {xy - wv.z, 1 - (xx + zz), yz + wv.x},
             {xz + wv.y, yz - wv.x, 1 - (xx + yy)}}};
}

/// Esg7::rate().
TRIHEDRON_INLINE V3 drift_rate(const V3& h, const V (&kappa)[kCoefficients]) {
  const V3 s = times(h, h);
  const V sum4 = dot(s, s);
  const V* k = kappa;
  return {h.x * (k[0] * (sum4 - s.x) + k[1] * s.y - k[3] * s.z) + k[5] * h.y * h.z,
          h.y * (k[0] * (sum4 - s.y) + k[2] * s.z - k[1] * s.x) + k[6] * h.z * h.x,
          h.z * (k[0] * (sum4 - s.z) + k[3] * s.x - k[2] * s.y) + k[4] * h.x * h.y};
}

/// sim::precess(), stage by stage of both gyros, neither of which waits for the other.
void turn_momenta(TrueGyro (&gyros)[kGyros], double step_s, const M3& middle, const M3& end) {
  M3 middle_b[kGyros];
  M3 end_b[kGyros];
  V3 h[kGyros];
  V3 k1[kGyros];
  V3 k2[kGyros];
  V3 k3[kGyros];
  const auto turn = [&](int k, const M3& C, const V3& h_b) {
    return all(step_s) * (C * drift_rate(h_b, gyros[k].kappa_rad_s));
  };
  const auto turn_at = [&](int k, const M3& C, const V3& its_h) { return turn(k, C, transposed_times(C, its_h)); };
  for (int k = 0; k < kGyros; ++k) {
    middle_b[k] = middle * gyros[k].C_c_b;
    h[k] = gyros[k].h_in;
    k1[k] = turn(k, gyros[k].C_in_b, gyros[k].h_b);
  }
  for (int k = 0; k < kGyros; ++k) {
    k2[k] = turn_at(k, middle_b[k], rotated_by_little(h[k], all(0.5) * k1[k]));
  }
  for (int k = 0; k < kGyros; ++k) {
    k3[k] = turn_at(k, middle_b[k], rotated_by_little(h[k], all(0.5) * k2[k] - all(0.125) * cross(k1[k], k2[k])));
    end_b[k] = end * gyros[k].C_c_b;
  }
  for (int k = 0; k < kGyros; ++k) {
    const V3 k4 = turn_at(k, end_b[k], rotated_by_little(h[k], k3[k]));
    gyros[k].h_in =
        rotated_by_little(h[k], all(1.0 / 6) * (k1[k] + all(2) * (k2[k] + k3[k]) + k4 - all(0.5) * cross(k1[k], k4)));
    gyros[k].C_in_b = end_b[k];
    gyros[k].h_b = transposed_times(end_b[k], gyros[k].h_in);
  }
}

/// ln x of normal numbers 0 < x < 1, to rounding.
TRIHEDRON_INLINE V logarithm(V x) {
  using Bits = long long __attribute__((vector_size(8 * kWidth)));
  constexpr long long kMantissa = 0x000fffffffffffff;
  constexpr long long kOne = 0x3ff0000000000000;
  constexpr double kRootOfTwo = 1.4142135623730951;
  constexpr double kLn2High = 0x1.62e42fefa38p-1;
  constexpr double kLn2Low = 0x1.ef35793c7673p-45;
  const Bits bits = reinterpret_cast<Bits>(x);
  V exponent = __builtin_convertvector((bits >> 52) - 1023, V);
  V m = reinterpret_cast<V>((bits & kMantissa) | kOne);
  const Mask is_large = m > kRootOfTwo;
  m = select(is_large, 0.5 * m, m);
  exponent = select(is_large, exponent + 1, exponent);
  // ln m = 2 artanh z, z = (m − 1) / (m + 1), |z| < 0.172.
  const V z = (m - 1) / (m + 1);
  const V z2 = z * z;
  V series{};
  for (int n = 23; n > 1; n -= 2) {
    series = z2 * (series + 1.0 / n);
  }
  return exponent * kLn2High + (exponent * kLn2Low + (2 * z + 2 * z * series));
}

void make_normal(const InCircle* points, int count, V* normal) {
  for (int i = 0; i < count; ++i) {
    const InCircle& point = points[i];
    const V factor = root(-2 * logarithm(point.square) / point.square);
    normal[2 * i] = point.x * factor;
    normal[2 * i + 1] = point.y * factor;
  }
}

void read(const TrueGyro (&gyros)[kGyros], const V3 (&noise)[kGyros], V3 (&h_b)[kGyros]) {
  for (int k = 0; k < kGyros; ++k) {
    const TrueGyro& its = gyros[k];
    h_b[k] = unit(times(its.one_and_scale, its.h_b) + its.bias + its.noise * noise[k]);
  }
}

// ---- Prediction

/// core/optimal_attitude.hpp, of two directions.
TRIHEDRON_INLINE M3 attitude_of(const Gyro (&gyro)[kGyros], const V3 (&h_c)[kGyros]) {
  const V3 x = unit(cross(gyro[0].h_in, gyro[1].h_in));
  const V3 y = unit(gyro[0].h_in + gyro[1].h_in);
  const V3 z = cross(x, y);
  const V3 x_c = unit(cross(h_c[0], h_c[1]));
  const V3 y_c = unit(h_c[0] + h_c[1]);
  const V3 z_c = cross(x_c, y_c);
  return {
      {x_c.x * x + (y_c.x * y + z_c.x * z), x_c.y * x + (y_c.y * y + z_c.y * z), x_c.z * x + (y_c.z * y + z_c.z * z)}};
}

/// precess_two() of core/precession.cpp, of one gyro, step by step. The filter of core sums up short steps
/// (StepsOfTwo), which is the same to a millionth of a sensitivity.
TRIHEDRON_INLINE void precess(Gyro& gyro, Sensitivity& since, const M3& C_in_c, const V3& h, double dt_s) {
  const V3 s = times(h, h);
  const V3 q = times(s, s);
  const V3 k0 = {h.x * (q.x - s.x + q.y + q.z), h.y * (q.y - s.y + q.z + q.x), h.z * (q.z - s.z + q.x + q.y)};
  const V x_mu12 = h.x * s.y;
  const V y_mu12 = -h.y * s.x;
  const V y_mu23 = h.y * s.z;
  const V z_mu23 = -h.z * s.y;
  const V x_mu31 = -h.x * s.z;
  const V z_mu31 = h.z * s.x;
  const V z_nu12 = h.x * h.y;
  const V x_nu23 = h.y * h.z;
  const V y_nu31 = h.z * h.x;
  M3 m = C_in_c * gyro.C_c_b;
  for (V3& column : m.column) {
    column = all(dt_s) * column;
  }
  const V* kappa = gyro.kappa_rad_s;
  const V3 rate = {k0.x * kappa[0] + x_mu12 * kappa[1] + x_mu31 * kappa[3] + x_nu23 * kappa[5],
                   k0.y * kappa[0] + y_mu12 * kappa[1] + y_mu23 * kappa[2] + y_nu31 * kappa[6],
                   k0.z * kappa[0] + z_mu23 * kappa[2] + z_mu31 * kappa[3] + z_nu12 * kappa[4]};
  const V3 turn = m * rate;
  gyro.h_in = unit(rotated_by_little(gyro.h_in, turn));
  for (int j = 0; j < 3; ++j) {
    since.by_start[j] = since.by_start[j] + cross(turn, since.by_start[j]);
    since.by_alignment[j] = since.by_alignment[j] + cross(turn, since.by_alignment[j] - C_in_c.column[j]);
  }
  const V3 added[kCoefficients] = {m * k0,
                                   x_mu12 * m.column[0] + y_mu12 * m.column[1],
                                   y_mu23 * m.column[1] + z_mu23 * m.column[2],
                                   x_mu31 * m.column[0] + z_mu31 * m.column[2],
                                   z_nu12 * m.column[2],
                                   x_nu23 * m.column[0],
                                   y_nu31 * m.column[1]};
  for (int i = 0; i < kCoefficients; ++i) {
    since.by_drift[i] = since.by_drift[i] + cross(turn, since.by_drift[i]) + added[i];
  }
}

void predict(Filter& filter, const V3 (&h_b)[kGyros], double dt_s) {
  V3 middle[kGyros];
  V3 middle_c[kGyros];
  for (int k = 0; k < kGyros; ++k) {
    middle[k] = unit(all(0.5) * (filter.h_b[k] + h_b[k]));
    middle_c[k] = filter.gyro[k].C_c_b * middle[k];
    filter.h_b[k] = h_b[k];
  }
  const M3 C_in_c = attitude_of(filter.gyro, middle_c);
  for (int k = 0; k < kGyros; ++k) {
    precess(filter.gyro[k], filter.since_fix[k], C_in_c, middle[k], dt_s);
  }
  filter.time_since_fix_s += dt_s;
}

// ---- Readings around a fix

/// x = (L Lᵀ)⁻¹ b.
TRIHEDRON_INLINE void solve(const double (&L)[kTerms][kTerms], const V (&b)[kTerms], V (&x)[kTerms]) {
  for (int i = 0; i < kTerms; ++i) {
    x[i] = b[i];
    for (int k = 0; k < i; ++k) {
      x[i] -= L[i][k] * x[k];
    }
    x[i] = x[i] / L[i][i];
  }
  for (int i = kTerms - 1; i >= 0; --i) {
    for (int k = i + 1; k < kTerms; ++k) {
      x[i] -= L[k][i] * x[k];
    }
    x[i] = x[i] / L[i][i];
  }
}

/// 1 − h hᵀ of both.
TRIHEDRON_INLINE M3 sum_across(const V3 (&h_c)[kGyros]) {
  M3 sum;
  for (int j = 0; j < 3; ++j) {
    const V a = j == 0 ? h_c[0].x : j == 1 ? h_c[0].y : h_c[0].z;
    const V b = j == 0 ? h_c[1].x : j == 1 ? h_c[1].y : h_c[1].z;
    sum.column[j] = all(2) * axis(j) - (a * h_c[0] + b * h_c[1]);
  }
  return sum;
}

/// core/directions_fit.hpp.
void fit(const Filter& filter, const Fit& its, const V3 (&at)[kGyros], FittedReadings& fitted) {
  constexpr int kFitted = 3 * kGyros + 1;
  const V3 normal = cross(filter.gyro[0].C_c_b * at[0], filter.gyro[1].C_c_b * at[1]);
  fitted.sine_square = dot(normal, normal);
  fitted.is_explained = V{};
  fitted.noise_factor = all(1);
  fitted.rate_c = zero3();
  fitted.unfollowed_square_rad2 = V{};
  fitted.unfollowed_sigma_rad2 = V{};
  for (int k = 0; k < kGyros; ++k) {
    fitted.h_b[k] = at[k];
  }
  if (its.count == 0) {
    return;
  }
  const auto cosine = [&](const V3& one, const V3& other) {
    return dot(filter.gyro[0].C_c_b * one, filter.gyro[1].C_c_b * other);
  };
  const V3* first = its.samples[0];
  const V first_cosine = cosine(first[0], first[1]);
  V right[kFitted][kTerms] = {};
  V squares[kGyros + 1] = {};
  for (int i = 0; i < its.count; ++i) {
    const V3* sample = its.samples[i];
    const V3 a = sample[0] - first[0];
    const V3 b = sample[1] - first[1];
    const V apart[kFitted] = {a.x, a.y, a.z, b.x, b.y, b.z, cosine(sample[0], sample[1]) - first_cosine};
    for (int column = 0; column < kFitted; ++column) {
      for (int term = 0; term < kTerms; ++term) {
        right[column][term] += its.powers[i][term] * apart[column];
      }
      squares[column / 3] += apart[column] * apart[column];
    }
  }
  V x[kFitted][kTerms];
  for (int column = 0; column < kFitted; ++column) {
    solve(its.L, right[column], x[column]);
    for (int term = 0; term < kTerms; ++term) {
      squares[column / 3] -= x[column][term] * right[column][term];
    }
  }
  const double freedom = 2 * (its.count - its.terms);
  const double bound = freedom + 5 * __builtin_sqrt(2 * freedom);
  V3 h_b[kGyros];
  V3 h_c[kGyros];
  V3 seen = zero3();
  Mask explained = all(0) == all(0);
  for (int k = 0; k < kGyros; ++k) {
    const V noise = filter.readout_noise_rad[k];
    squares[k] = larger(squares[k], V{});
    explained = explained & (squares[k] <= bound * noise * noise);
    const V(*its_x)[kTerms] = &x[3 * k];
    const V3 h = first[k] + V3{its_x[0][0], its_x[1][0], its_x[2][0]};
    const V by = 1 / root(dot(h, h));
    h_b[k] = by * h;
    const V3 rate = (by / its.reach_s) * V3{its_x[0][1], its_x[1][1], its_x[2][1]};
    h_c[k] = filter.gyro[k].C_c_b * h_b[k];
    seen = seen + cross(filter.gyro[k].C_c_b * (rate - dot(h_b[k], rate) * h_b[k]), h_c[k]);
  }
  const V3 rate_c = inverse(sum_across(h_c)) * seen;
  // FittedDirections::unfollowed().
  constexpr double kLeastSineSquare = 0.1;
  const V beside = larger(squares[kGyros], V{});
  const V now = dot(h_c[0], h_c[1]);
  const V sine_square = 1 - now * now;
  const double n = freedom / 2;
  const V a = filter.readout_noise_rad[0] * filter.readout_noise_rad[0];
  const V b = filter.readout_noise_rad[1] * filter.readout_noise_rad[1];
  const V unfollowed = 0.5 * ((squares[0] + squares[1]) / (2 * n) - beside / (n * sine_square));
  const V by_chance = root((2 * (a + b) * (a + b) - a * a - b * b) / (4 * n));

  fitted.is_explained = select(explained, all(1), V{});
  fitted.noise_factor = select(explained, all(its.noise_factor), all(1));
  const Mask is_told = explained & (sine_square > kLeastSineSquare);
  fitted.unfollowed_square_rad2 = select(is_told, unfollowed, V{});
  fitted.unfollowed_sigma_rad2 = select(is_told, by_chance, V{});
  fitted.rate_c = {select(explained, rate_c.x, V{}), select(explained, rate_c.y, V{}),
                   select(explained, rate_c.z, V{})};
  for (int k = 0; k < kGyros; ++k) {
    fitted.h_b[k] = {select(explained, h_b[k].x, at[k].x), select(explained, h_b[k].y, at[k].y),
                     select(explained, h_b[k].z, at[k].z)};
  }
}

// ---- The root of the covariance (core/square_root_covariance.hpp)

TRIHEDRON_INLINE V signed_norm(V first, V below) {
  const V norm = root(first * first + below);
  return select(first > 0, -norm, norm);
}

/// Reflections that bring M rows of `extra` into the triangle, which may have zeros on its diagonal.
template <int M>
TRIHEDRON_INLINE void rotate_into(V* triangle, int stride, V* extra, int extra_stride, int columns, int eliminated) {
  for (int j = 0; j < eliminated; ++j) {
    V* row = triangle + j * stride;
    V v[M];
    V below{};
    for (int i = 0; i < M; ++i) {
      v[i] = extra[i * extra_stride + j];
      below += v[i] * v[i];
    }
    const V alpha = signed_norm(row[j], below);
    const V v0 = row[j] - alpha;
    const Mask is_there = below > 0;
    const V beta = select(is_there, -1 / select(is_there, alpha * v0, all(1)), V{});
    row[j] = select(is_there, alpha, row[j]);
    for (int k = j + 1; k < columns; ++k) {
      V sum = v0 * row[k];
      for (int i = 0; i < M; ++i) {
        sum += v[i] * extra[i * extra_stride + k];
      }
      sum *= beta;
      row[k] -= v0 * sum;
      for (int i = 0; i < M; ++i) {
        extra[i * extra_stride + k] -= v[i] * sum;
      }
    }
  }
}

/// M rows times the root from state `first` on; those of the rows begin there.
template <int M>
TRIHEDRON_INLINE void see_through(const V* S, int first, V* rows, int stride) {
  const int columns = kStates - first;
  for (int j = columns - 1; j >= 0; --j) {
    V x[M];
    Mask is_there{};
    for (int i = 0; i < M; ++i) {
      x[i] = rows[i * stride + j];
      is_there = is_there | (x[i] != 0);
    }
    if (!any(is_there)) {
      continue;
    }
    const V* its = S + (first + j) * kStates + first;
    for (int i = 0; i < M; ++i) {
      rows[i * stride + j] = x[i] * its[j];
    }
    for (int k = j + 1; k < columns; ++k) {
      const V element = its[k];
      for (int i = 0; i < M; ++i) {
        rows[i * stride + k] += x[i] * element;
      }
    }
  }
}

/// take_measurements() of M rows, whose last column is what they show.
template <int M>
TRIHEDRON_INLINE void take_measurements(V* S, V* rows, V* correction) {
  constexpr int kNumbers = 2 * M + 1;
  V numbers[kStates * kNumbers];
  see_through<M>(S, 0, rows, kColumns);
  V variance[M];
  V inverse[M];
  V sums[M][M] = {};
  for (int m = 0; m < M; ++m) {
    variance[m] = inverse[m] = all(1);
  }
  for (int j = 0; j < kStates; ++j) {
    V* c = numbers + j * kNumbers;
    V* e = c + M;
    V square = all(1);
    for (int m = 0; m < M; ++m) {
      V x = rows[m * kColumns + j];
      for (int i = 0; i < m; ++i) {
        const V before = x;
        x -= c[i] * sums[m][i];
        sums[m][i] += e[i] * before;
      }
      c[m] = x * inverse[m];
      e[m] = square * x;
      const V before = variance[m];
      variance[m] += e[m] * x;
      inverse[m] = 1 / variance[m];
      square *= before * inverse[m];
    }
    e[M] = root(square);
  }
  V gain[M];
  for (int m = 0; m < M; ++m) {
    V rest = rows[m * kColumns + kStates];
    for (int i = 0; i < m; ++i) {
      rest -= sums[m][i] * gain[i];
    }
    gain[m] = rest * inverse[m];
  }
  for (int row = 0; row < kStates; ++row) {
    V b[M] = {};
    for (int j = row; j < kStates; ++j) {
      const V* c = numbers + j * kNumbers;
      const V* e = c + M;
      V x = S[row * kStates + j];
      for (int m = 0; m < M; ++m) {
        const V before = x;
        x -= c[m] * b[m];
        b[m] += e[m] * before;
      }
      S[row * kStates + j] = e[M] * x;
    }
    V sum{};
    for (int m = 0; m < M; ++m) {
      sum += gain[m] * b[m];
    }
    correction[row] = sum;
  }
}

/// rows · rowsᵀ.
TRIHEDRON_INLINE M3 gram(const V* rows, int columns, int stride) {
  V xx{}, yy{}, zz{}, xy{}, xz{}, yz{};
  for (int i = 0; i < columns; ++i) {
    const V x = rows[i];
    const V y = rows[stride + i];
    const V z = rows[2 * stride + i];
    xx += x * x;
    yy += y * y;
    zz += z * z;
    xy += x * y;
    xz += x * z;
    yz += y * z;
  }
  return {{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}};
}

TRIHEDRON_INLINE void put(V* rows, int stride, int column, const V3& its) {
  rows[column] = its.x;
  rows[stride + column] = its.y;
  rows[2 * stride + column] = its.z;
}

/// Covariance of what depends by these columns on the states from `first` on.
template <int Columns>
[[gnu::noinline]] M3 covariance_from(const V* S, int first, const V3 (&columns)[Columns]) {
  V rows[3 * kStates] = {};
  for (int j = 0; j < Columns; ++j) {
    put(rows, kStates, j, columns[j]);
  }
  see_through<3>(S, first, rows, kStates);
  return gram(rows, kStates - first, kStates);
}

/// 1-sigma per axis of ½ a × b.
TRIHEDRON_INLINE V second_order_of(const M3& A, const M3& B) {
  V product{};
  for (int j = 0; j < 3; ++j) {
    product += dot(A.column[j], B.column[j]);
  }
  return root(larger(trace(A) * trace(B) - product, V{}) / 8);
}

// ---- A fix, stage by stage

void follow_alignments(Filter& filter, const FittedReadings& readings) {
  for (int k = 0; k < kGyros; ++k) {
    const Gyro& gyro = filter.gyro[k];
    Sensitivity& since = filter.since_fix[k];
    for (V3& column : since.by_drift) {
      column = column - dot(gyro.h_in, column) * gyro.h_in;
    }
    const V3& h_b = readings.h_b[k];
    V3& before = filter.h_b_at_fix[k];
    const V3 moved_c = gyro.C_c_b * V3{float_difference(h_b.x, before.x), float_difference(h_b.y, before.y),
                                       float_difference(h_b.z, before.z)};
    const V moved[3] = {moved_c.x, moved_c.y, moved_c.z};
    for (int j = 0; j < 3; ++j) {
      V3& column = since.by_alignment[j];
      column = column + (moved[j] - dot(column, gyro.h_in)) * gyro.h_in;
    }
    before = {as_float(h_b.x), as_float(h_b.y), as_float(h_b.z)};
  }
}

constexpr double kHoldSecondOrder_s = 30;

/// In single precision, as there: with dropouts times come to be just as long as one of the bounds.
void look_at_second_order(Filter& filter, const V3& rate_as_read_c) {
  const V interval_s = as_float(filter.time_since_fix_s);
  const V hold_s = float_difference(filter.second_order_hold_s, interval_s);
  const V3 rate_c = {as_float(rate_as_read_c.x), as_float(rate_as_read_c.y), as_float(rate_as_read_c.z)};
  const V3 apart = rate_c - filter.second_order_rate_c;
  const V3& rate = filter.second_order_rate_c;
  const Mask holds = (hold_s > 0) & (hold_s <= kHoldSecondOrder_s) &
                     (interval_s <= as_float(1.5 * filter.second_order_interval_s)) &
                     (root(dot(apart, apart)) < 0.5 * root(dot(rate, rate)));
  filter.second_order_hold_s = select(holds, hold_s, V{});
  filter.second_order_interval_s = select(holds, filter.second_order_interval_s, interval_s);
  filter.second_order_rate_c = {select(holds, rate.x, rate_c.x), select(holds, rate.y, rate_c.y),
                                select(holds, rate.z, rate_c.z)};
}

/// 1-sigma per axis of the directions.
TRIHEDRON_INLINE V prediction_noise(Filter& filter, const M3& C_in_c, int k) {
  const V time_s = filter.time_since_fix_s;
  const Mask is_due = (filter.second_order_hold_s <= 0) & (time_s > 0);
  if (any(is_due)) {
    const M3 alignment = covariance_from(filter.root, alignment_of(k), C_in_c.column);
    const M3 drift = covariance_from(filter.root, drift_of(k), filter.since_fix[k].by_drift);
    filter.second_order_prediction_rad_s[k] =
        select(is_due, second_order_of(alignment, drift) / select(is_due, time_s, all(1)),
               filter.second_order_prediction_rad_s[k]);
  }
  constexpr double kOfARamp = 1.4;
  const V before = filter.second_order_rad[k];
  const V now = before + kOfARamp * filter.second_order_prediction_rad_s[k] * time_s;
  filter.second_order_rad[k] = now;
  const V walk = filter.direction_random_walk_rad_sqrt_s;
  return root(walk * walk * time_s + (now * now - before * before));
}

/// SquareRootCovariance::propagate().
void propagate(Filter& filter, const V (&noise_rad)[kGyros]) {
  constexpr int d = kMoving;
  V F[d * kStates] = {};
  for (int k = 0; k < kGyros; ++k) {
    Sensitivity& since = filter.since_fix[k];
    V* by = F + direction_of(k) * kStates;
    for (int j = 0; j < kCoefficients; ++j) {
      put(by, kStates, drift_of(k) + j, since.by_drift[j]);
      since.by_drift[j] = zero3();
    }
    for (int j = 0; j < 3; ++j) {
      put(by, kStates, direction_of(k) + j, since.by_start[j]);
      put(by, kStates, alignment_of(k) + j, since.by_alignment[j]);
      since.by_alignment[j] = zero3();
      since.by_start[j] = axis(j);
    }
    see_through<3>(filter.root, 0, by, kStates);
  }
  V reversed[d * d] = {};
  V moved[d * d];
  for (int i = 0; i < d; ++i) {
    reversed[i * d + i] = noise_rad[(d - 1 - i) / 3];
    for (int j = 0; j < d; ++j) {
      moved[j * d + d - 1 - i] = F[i * kStates + j];
    }
  }
  rotate_into<d>(reversed, d, moved, d, d, d);
  for (int i = 0; i < d; ++i) {
    V* row = filter.root + i * kStates;
    for (int j = i; j < d; ++j) {
      row[j] = reversed[(d - 1 - j) * d + d - 1 - i];
    }
    for (int j = d; j < kStates; ++j) {
      row[j] = F[i * kStates + j];
    }
  }
  filter.time_since_fix_s = V{};
}

/// The attitude by the gyros, and its covariance without that of jitter.
void put_attitude(const Filter& filter, const FittedReadings& readings, M3& C_in_c, M3& covariance_rad2) {
  V3 h_c[kGyros];
  for (int k = 0; k < kGyros; ++k) {
    h_c[k] = filter.gyro[k].C_c_b * readings.h_b[k];
  }
  C_in_c = attitude_of(filter.gyro, h_c);
  const M3 weights = inverse(sum_across(h_c));
  V rows[3 * kStates] = {};
  M3 noise{};
  for (int k = 0; k < kGyros; ++k) {
    // (1 − h hᵀ) of one direction.
    const V h[3] = {h_c[k].x, h_c[k].y, h_c[k].z};
    M3 across;
    for (int j = 0; j < 3; ++j) {
      across.column[j] = axis(j) - h[j] * h_c[k];
    }
    const M3 by_phi = weights * across;
    const M3 by_direction = by_phi * transposed(C_in_c);
    for (int j = 0; j < 3; ++j) {
      put(rows, kStates, direction_of(k) + j, by_direction.column[j]);
      put(rows, kStates, alignment_of(k) + j, V3{} - by_phi.column[j]);
    }
    const V sigma = readings.noise_factor * filter.readout_noise_rad[k];
    const M3 square = by_phi * transposed(by_phi);
    for (int j = 0; j < 3; ++j) {
      noise.column[j] = noise.column[j] + (sigma * sigma) * square.column[j];
    }
  }
  see_through<3>(filter.root, 0, rows, kStates);
  covariance_rad2 = gram(rows, kStates, kStates);
  for (int j = 0; j < 3; ++j) {
    covariance_rad2.column[j] = covariance_rad2.column[j] + noise.column[j];
  }
}

/// InvariantEstimator::fused_attitude(); R_rad2: of the fix, about the axes.
M3 fused_attitude(const M3& by_gyros, const M3& P, const M3& fix, const V3& R_rad2) {
  const V3 apart = rotation_vector(transposed(by_gyros) * fix);
  const V a = P.column[0].x + R_rad2.x;
  const V b = P.column[1].y + R_rad2.y;
  const V c = P.column[2].z + R_rad2.z;
  const V l00 = root(a);
  const V l10 = P.column[0].y / l00;
  const V l20 = P.column[0].z / l00;
  const V l11 = root(b - l10 * l10);
  const V l21 = (P.column[1].z - l20 * l10) / l11;
  const V l22 = root(c - l20 * l20 - l21 * l21);
  const V y0 = apart.x / l00;
  const V y1 = (apart.y - l10 * y0) / l11;
  const V y2 = (apart.z - l20 * y0 - l21 * y1) / l22;
  const V x2 = y2 / l22;
  const V x1 = (y1 - l21 * x2) / l11;
  const V x0 = (y0 - l10 * x1 - l20 * x2) / l00;
  const V3 turn = P * V3{x0, x1, x2};
  return by_gyros * M3{{rotated(axis(0), turn), rotated(axis(1), turn), rotated(axis(2), turn)}};
}

/// InvariantEstimator::fix_reading_noise().
void put_reading_noise(Filter& filter, const M3& C_linear, const V& noise_factor, V (&noise_rad)[kGyros]) {
  constexpr double kSmallSecondOrder = 0.1;
  for (int k = 0; k < kGyros; ++k) {
    noise_rad[k] = filter.readout_noise_rad[k] * noise_factor;
  }
  const Mask is_due = filter.second_order_hold_s <= 0;
  if (any(is_due)) {
    Mask all_small = is_due;
    for (int k = 0; k < kGyros; ++k) {
      const V3* C = C_linear.column;
      const M3 alignment = covariance_from(filter.root, alignment_of(k), C_linear.column);
      V rows[3 * kStates] = {};
      for (int j = 0; j < 3; ++j) {
        put(rows, kStates, alignment_of(k) + j, V3{} - C[j]);
        put(rows, kStates, direction_of(k) + j, axis(j));
      }
      see_through<3>(filter.root, 0, rows, kStates);
      const V its = second_order_of(alignment, gram(rows, kStates, kStates));
      filter.second_order_reading_rad[k] = select(is_due, its, filter.second_order_reading_rad[k]);
      const V most =
          larger(filter.second_order_reading_rad[k], filter.second_order_prediction_rad_s[k] * kHoldSecondOrder_s);
      all_small = all_small & (most < kSmallSecondOrder * noise_rad[k]);
    }
    filter.second_order_hold_s =
        select(is_due, select(all_small, all(kHoldSecondOrder_s), V{}), filter.second_order_hold_s);
  }
  for (int k = 0; k < kGyros; ++k) {
    const V its = filter.second_order_reading_rad[k];
    noise_rad[k] = root(noise_rad[k] * noise_rad[k] + its * its);
  }
}

/// Cholesky factor in place, of the lower triangle.
TRIHEDRON_INLINE void factorize(V (&a)[kComponents][kComponents]) {
  for (int j = 0; j < kComponents; ++j) {
    V square = a[j][j];
    for (int k = 0; k < j; ++k) {
      square -= a[j][k] * a[j][k];
    }
    a[j][j] = root(square);
    for (int i = j + 1; i < kComponents; ++i) {
      V sum = a[i][j];
      for (int k = 0; k < j; ++k) {
        sum -= a[i][k] * a[j][k];
      }
      a[i][j] = sum / a[j][j];
    }
  }
}

/// compare() and InvariantEstimator::whitened().
void judge(const Filter& filter, const M3& C_linear, const V3& R_rad2, const V (&noise_rad)[kGyros], Fix& fix) {
  V* rows = fix.rows;
  for (int i = 0; i < kComponents * kColumns; ++i) {
    rows[i] = V{};
  }
  V3 by_fix[kComponents];
  fix.misfit_rad = V{};
  for (int k = 0; k < kGyros; ++k) {
    const V3& h = filter.gyro[k].h_in;
    const V3 first = unit(cross(h, filter.gyro[1 - k].h_in));
    const V3 by_phi[2] = {first, cross(h, first)};
    const V3 off = cross(h, fix.C_in_c * (filter.gyro[k].C_c_b * fix.readings.h_b[k]));
    for (int i = 0; i < 2; ++i) {
      const int component = 2 * k + i;
      V* row = rows + component * kColumns;
      by_fix[component] = transposed_times(C_linear, by_phi[i]);
      put(row, 1, direction_of(k), by_phi[i]);
      put(row, 1, alignment_of(k), V3{} - by_fix[component]);
      row[kStates] = dot(by_phi[i], off);
      fix.misfit_rad += row[kStates] * row[kStates];
    }
  }
  fix.misfit_rad = root(fix.misfit_rad);
  V L[kComponents][kComponents];
  for (int i = 0; i < kComponents; ++i) {
    for (int j = 0; j <= i; ++j) {
      L[i][j] = dot(times(R_rad2, by_fix[i]), by_fix[j]);
    }
    L[i][i] += noise_rad[i / 2] * noise_rad[i / 2];
  }
  factorize(L);
  V through[kComponents * kColumns];
  for (int i = 0; i < kComponents; ++i) {
    V* row = rows + i * kColumns;
    const V by = 1 / L[i][i];
    for (int column = 0; column < kColumns; ++column) {
      V its = row[column];
      for (int k = 0; k < i; ++k) {
        its -= L[i][k] * rows[k * kColumns + column];
      }
      row[column] = its * by;
      through[i * kColumns + column] = row[column];
    }
  }
  see_through<kComponents>(filter.root, 0, through, kColumns);
  V S[kComponents][kComponents];
  for (int i = 0; i < kComponents; ++i) {
    for (int j = 0; j <= i; ++j) {
      V sum = all(i == j ? 1 : 0);
      for (int column = 0; column < kStates; ++column) {
        sum += through[i * kColumns + column] * through[j * kColumns + column];
      }
      S[i][j] = sum;
    }
  }
  factorize(S);
  V y[kComponents];
  fix.nis = V{};
  for (int i = 0; i < kComponents; ++i) {
    V sum = rows[i * kColumns + kStates];
    for (int k = 0; k < i; ++k) {
      sum -= S[i][k] * y[k];
    }
    y[i] = sum / S[i][i];
    fix.nis += y[i] * y[i];
  }
}

void begin_fix(Filter& filter, Fix& fix) {
  const FittedReadings& readings = fix.readings;
  V3 h_c[kGyros];
  for (int k = 0; k < kGyros; ++k) {
    filter.h_b[k] = readings.h_b[k];
    h_c[k] = filter.gyro[k].C_c_b * readings.h_b[k];
  }
  follow_alignments(filter, readings);
  look_at_second_order(filter, readings.rate_c);
  const M3 C_now = attitude_of(filter.gyro, h_c);
  V noise_rad[kGyros];
  for (int k = 0; k < kGyros; ++k) {
    noise_rad[k] = prediction_noise(filter, C_now, k);
  }
  propagate(filter, noise_rad);
  const V3 R_rad2 = filter.fix_variance_rad2 + V3{fix.jitter_rad2, fix.jitter_rad2, fix.jitter_rad2};
  M3 by_gyros;
  M3 covariance_rad2;
  put_attitude(filter, readings, by_gyros, covariance_rad2);
  fix.apart_rad = root(larger(3 - trace(transposed(by_gyros) * fix.C_in_c), V{}));
  const M3 C_linear = fused_attitude(by_gyros, covariance_rad2, fix.C_in_c, R_rad2);
  put_reading_noise(filter, C_linear, readings.noise_factor, noise_rad);
  judge(filter, C_linear, R_rad2, noise_rad, fix);
}

void finish_fix(Filter& filter, Fix& fix) {
  const Mask is_used = fix.is_used > 0.5;
  filter.second_order_hold_s = select(is_used, filter.second_order_hold_s, V{});
  for (V& its : fix.rows) {
    its = select(is_used, its, V{});
  }
  V x[kStates];
  take_measurements<kComponents>(filter.root, fix.rows, x);
  for (int k = 0; k < kGyros; ++k) {
    Gyro& gyro = filter.gyro[k];
    const V* phi = x + direction_of(k);
    gyro.h_in = unit(rotated(gyro.h_in, {phi[0], phi[1], phi[2]}));
    for (int i = 0; i < kCoefficients; ++i) {
      gyro.kappa_rad_s[i] += x[drift_of(k) + i];
    }
    const V* delta = x + alignment_of(k);
    for (V3& column : gyro.C_c_b.column) {
      column = rotated(column, {delta[0], delta[1], delta[2]});
    }
  }
  M3 covariance_rad2;
  put_attitude(filter, fix.readings, fix.attitude, covariance_rad2);
  fix.sigma_rad = {root(covariance_rad2.column[0].x + fix.jitter_rad2),
                   root(covariance_rad2.column[1].y + fix.jitter_rad2),
                   root(covariance_rad2.column[2].z + fix.jitter_rad2)};
}

void blend(Filter& filter, const Filter& before, const V& kept) {
  const Mask is_kept = kept > 0.5;
  V* its = reinterpret_cast<V*>(&filter);
  const V* earlier = reinterpret_cast<const V*>(&before);
  for (unsigned i = 0; i < sizeof(Filter) / sizeof(V); ++i) {
    its[i] = select(is_kept, its[i], earlier[i]);
  }
}

void add_error(const Fix& fix, const M3& truth, const V& counts, Errors& errors) {
  const V3 error = rotation_vector(transposed(truth) * fix.attitude);
  const Mask is_counted = counts > 0.5;
  const V3 square = times(error, error);
  const V3 sigma_square = times(fix.sigma_rad, fix.sigma_rad);
  const V normalised = (square.x / sigma_square.x + square.y / sigma_square.y + square.z / sigma_square.z) / 3;
  V3& sum = errors.squares_rad2;
  sum = {select(is_counted, sum.x + square.x, sum.x), select(is_counted, sum.y + square.y, sum.y),
         select(is_counted, sum.z + square.z, sum.z)};
  errors.normalised = select(is_counted, errors.normalised + normalised, errors.normalised);
  errors.count = select(is_counted, errors.count + 1, errors.count);
}

}  // namespace

const Kernels kKernels = {attitude, turn_momenta, make_normal, read,  predict,
                          fit,      begin_fix,    finish_fix,  blend, add_error};

}  // namespace trihedron::lanes::TRIHEDRON_LANES_PROCESSOR

#undef TRIHEDRON_INLINE
