#pragma once
/// The functions that carry eight flights at once, compiled for several kinds of processor. Each flight is rounded as
/// it would be alone, on each of them, whatever the others do.

#include "state.hpp"

namespace trihedron::lanes {

struct Kernels {
  /// C_in_c at a time of the pass.
  void (*attitude)(const Attitude& attitude, double t_s, M3& C_in_c);
  /// The true momenta over a step, with the attitude of its middle and end.
  void (*turn_momenta)(TrueGyro (&gyros)[kGyros], double step_s, const M3& middle, const M3& end);
  /// Two standard normal numbers for each of the points.
  void (*make_normal)(const InCircle* points, int count, V* normal);
  /// Unit readings; noise: of unit variance, three for each gyro.
  void (*read)(const TrueGyro (&gyros)[kGyros], const V3 (&noise)[kGyros], V3 (&h_b)[kGyros]);

  /// InvariantEstimator::predict() to the next sample.
  void (*predict)(Filter& filter, const V3 (&h_b)[kGyros], double dt_s);
  /// Readings::at(); `at`: the sample at the time of the fix.
  void (*fit)(const Filter& filter, const Fit& fit, const V3 (&at)[kGyros], FittedReadings& fitted);
  /// The stages of InvariantEstimator::correct() up to the judgement of the gate, and those after it with the attitude
  /// that then is.
  void (*begin_fix)(Filter& filter, Fix& fix);
  void (*finish_fix)(Filter& filter, Fix& fix);
  /// Takes back what has happened since `before` to the flights of which `kept` is 0.
  void (*blend)(Filter& filter, const Filter& before, const V& kept);
  /// Adds the error of an attitude, of the flights of which `counts` is 1.
  void (*add_error)(const Fix& fix, const M3& truth, const V& counts, Errors& errors);
};

/// Those for the processor that this runs on.
[[nodiscard]] const Kernels& kernels();

namespace any_processor {
extern const Kernels kKernels;
}
#ifdef __x86_64__
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}
#endif

}  // namespace trihedron::lanes
