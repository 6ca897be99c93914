#pragma once
/// Whether the fixes and the readings of a pass belong together as they are told, and which usual mistake of reading
/// them explains it where they do not. docs/telemetry.md, "What inspect tries".

#include <array>
#include <optional>
#include <vector>

#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/clocks.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// A component that is taken from one of those that are told, with this sign.
struct SignedComponent {
  int from = 0;  ///< 0 to 3: x, y, z, w as told
  int sign = 1;

  [[nodiscard]] bool operator==(const SignedComponent&) const = default;
};

/// Where the scalar of a quaternion is, of x, y, z, w as told: there; in the place of x, it is the first component and
/// told as the last; in that of z, the last and told as the first. The others follow in their order, beginning anew
/// after w. The axis, 0 to 2, in whose place a component stands then.
[[nodiscard]] inline int axis_of(const SignedComponent& part, int scalar_from) {
  return (part.from + 3 - scalar_from) % 4;
}

/// What was taken for something else.
struct Mistake {
  enum class Kind {
    kQuaternion,      ///< order, signs or direction of the fixes' quaternions: `components` are the right x, y, z, w
    kGyroAxes,        ///< of `gyro`: `components` are the right x, y, z
    kGyrosExchanged,  ///< each of the first two gyros has the readings of the other
    kClock,           ///< the fixes were taken `offset_s` after their stamp
    kNothingTried,    ///< the fixes are not of these gyros, or something else is wrong with them
  };
  Kind kind{};
  int gyro = 0;
  std::array<SignedComponent, 4> components{};
  double offset_s = 0;
  double motion_rad = 0;  ///< that momenta are left with when it is mended; as in Consistency
};

/// Momenta hardly move in inertial axes. How far they do, by the readings and the fixes together: the angle from their
/// mean over 20 minutes that 80 of 100 fixes do not exceed.
struct Consistency {
  PerGyro<double> motion_rad{};  ///< as told; NaN of a gyro without readings
  /// More than alignments and drift can make of it, by what is known of them before the pass.
  PerGyro<double> allowed_rad{};
  bool is_consistent = true;
  /// Each of which would explain it alone. More than one: the pass does not tell which it is.
  std::vector<Mistake> mistakes;
};

/// Nothing where the pass has too few fixes with readings beside them. `clocks` of the pass, where it shows them.
[[nodiscard]] std::optional<Consistency> consistency_of(const Pass& pass, const std::optional<Clocks>& clocks);

}  // namespace trihedron::ground
