#pragma once
/// What the kernels work on: each number is that of eight flights side by side (core/lanes.hpp has two gyros of one).
/// Plain data, so that a source compiled for one kind of processor shares no function with those compiled for any.

namespace trihedron::lanes {

/// Flights side by side.
inline constexpr int kWidth = 8;

/// Its elements may be reached by their address.
using V = double __attribute__((vector_size(8 * kWidth), may_alias));

struct V3 {
  V x;
  V y;
  V z;
};

/// By its columns.
struct M3 {
  V3 column[3];
};

/// Scalar last.
struct Quaternion {
  V3 v;
  V w;
};

inline constexpr int kGyros = 2;
inline constexpr int kCoefficients = 7;  ///< of eq. (1): k0, μ12, μ23, μ31, ν12, ν23, ν31
/// States as in core/layout.hpp: directions of both momenta; coefficients and alignment of each gyro.
inline constexpr int kMoving = 6;
inline constexpr int kStates = 26;
inline constexpr int kConstants = kStates - kMoving;
inline constexpr int kColumns = kStates + 1;  ///< of the rows of a fix, with what they show
inline constexpr int kComponents = 4;         ///< of a fix
inline constexpr int kTerms = 4;              ///< of the polynomials through the readings around a fix

/// By which a momentum turns in a step, at most.
inline constexpr double kLittle_rad = 1e-5;

[[nodiscard]] constexpr int direction_of(int gyro) { return 3 * gyro; }
[[nodiscard]] constexpr int drift_of(int gyro) { return kMoving + gyro * (kCoefficients + 3); }
[[nodiscard]] constexpr int alignment_of(int gyro) { return drift_of(gyro) + kCoefficients; }

/// Values and second derivatives of a cubic spline at a node.
struct SplineNode {
  V value[4];
  V second[4];
};

/// The attitude in the making (sim/attitude.hpp): a spline of the reference through nodes at even distances, the turn
/// that each flight makes or has made, jitter by a B-spline.
struct Attitude {
  bool is_together = true;  ///< whether nodes and knots of all flights are at the same times
  const SplineNode* nodes = nullptr;
  int node_count = 0;
  V begin_s;
  V spacing_s;
  /// from exp([s(u) v×]), u = (t − begin) × turns_per_s from 0 to 1.
  V turn_begin_s;
  V turns_per_s;
  Quaternion turn_from;
  V3 turn_rad;
  const V3* jitter = nullptr;  ///< coefficients; null where there is none
  int jitter_count = 0;
  V jitter_begin_s;
  double jitter_knots_per_s = 1;
  V jitter_rad;
};

/// Points in the unit circle, from which normal numbers are made (sim/random.hpp).
struct InCircle {
  V x;
  V y;
  V square;
};

/// A gyro as it is (sim/gyro.hpp).
struct TrueGyro {
  V kappa_rad_s[kCoefficients];
  M3 C_c_b;
  M3 C_in_b;
  V3 h_in;
  V3 h_b;
  V3 one_and_scale;  ///< 1 + scale of each direction cosine
  V3 bias;
  V noise;
};

/// A gyro as it is estimated.
struct Gyro {
  V3 h_in;
  V kappa_rad_s[kCoefficients];
  M3 C_c_b;
};

/// Of a momentum to what was at the last fix, and to the parameters since (core/precession.hpp): by columns.
struct Sensitivity {
  V3 by_start[3];
  V3 by_drift[kCoefficients];
  V3 by_alignment[3];
};

/// InvariantEstimator of a pair with eq. (1). All its members are vectors of V: see blend().
struct Filter {
  Gyro gyro[kGyros];
  Sensitivity since_fix[kGyros];
  V root[kStates * kStates];  ///< of the covariance
  V time_since_fix_s;
  V3 h_b[kGyros];  ///< readings from which the next step starts
  V second_order_rad[kGyros];
  V second_order_prediction_rad_s[kGyros];
  V second_order_reading_rad[kGyros];
  V second_order_hold_s;
  V second_order_interval_s;
  V3 second_order_rate_c;
  V3 h_b_at_fix[kGyros];
  // Settings.
  V readout_noise_rad[kGyros];
  V3 fix_variance_rad2;  ///< about c axes
  V direction_random_walk_rad_sqrt_s;
};

/// How the samples around a fix are fitted; the same for all flights, since their times are.
struct Fit {
  const V3 (*samples)[kGyros] = nullptr;
  const double (*powers)[kTerms] = nullptr;
  double L[kTerms][kTerms]{};  ///< Cholesky factor of the normal equations
  int count = 0;
  int terms = 0;
  double reach_s = 1;
  double noise_factor = 1;
};

/// What the gyros read at a fix (core/readings.hpp).
struct FittedReadings {
  V3 h_b[kGyros];
  V3 rate_c;
  V noise_factor;
  V is_explained;  ///< 1 or 0; where 0, the rest is of the sample itself
  V sine_square;   ///< of the angle between the momenta, by the readings
  V unfollowed_square_rad2;
  V unfollowed_sigma_rad2;
};

/// A fix while it is dealt with, and what came of it.
struct Fix {
  M3 C_in_c;
  FittedReadings readings;
  V jitter_rad2;
  V rows[kComponents * kColumns];
  V nis;
  V misfit_rad;
  V apart_rad;  ///< from the attitude by the gyros
  V is_used;    ///< 1 or 0
  M3 attitude;
  V3 sigma_rad;
};

/// Of the errors of the attitude.
struct Errors {
  V3 squares_rad2;
  V normalised;
  V count;
};

}  // namespace trihedron::lanes
