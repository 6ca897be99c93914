#pragma once
/// Kernels of NAIF's SPICE: attitude as a CK of type 3, with its spacecraft clock (SCLK) and its frames (FK), and a
/// calibration as an FK. docs/interchange.md has the conventions.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// The spacecraft in SPICE. Frame c has the number id · 1000, the case axes of gyro k id · 1000 − k.
struct SpiceObject {
  int naif_id = -999;  ///< negative, as those of spacecraft are
  std::string name = "UNKNOWN";

  [[nodiscard]] int frame_id() const { return naif_id * 1000; }
  /// "RESURS-DK1_C": upper case, what is no letter or digit but - is _.
  [[nodiscard]] std::string frame_name() const;
  [[nodiscard]] std::string gyro_frame_name(std::size_t gyro) const;
};

inline constexpr int kFirstNaifId = -1;
inline constexpr int kLastNaifId = -2'000'000;  ///< that times 1000 is a 32-bit integer

/// Throws UsageError for a number that is none of a spacecraft, and for a name from which no frame can be named.
void expect_spice_object(const SpiceObject& object);

/// The clock of a C-kernel: it counts nanoseconds (ticks) since the last whole second of TT before the first epoch,
/// so that ticks are whole numbers below 2^53, and exact.
struct SpiceClock {
  std::int64_t tt_since_j2000_s = 0;  ///< of its zero
  Time zero{};

  /// Throws UsageError where the attitude spans more than 104 days.
  [[nodiscard]] static SpiceClock of(const AttitudeHistory& attitude);
  [[nodiscard]] double ticks(Time t) const;
};

/// Angular velocity of c with respect to in, c axes, at every epoch: of the given rates, or where there are none by the
/// rotations to both neighbours of the stretch (of second order, at its ends of first), zero where a stretch is a
/// single epoch.
[[nodiscard]] std::vector<Eigen::Vector3d> rates_of(const AttitudeHistory& attitude,
                                                    std::span<const Eigen::Vector3d> given,
                                                    std::span<const std::size_t> stretches);

/// The bytes of a binary DAF of one segment of type 3, with angular velocity, relative to J2000, which in SPICE is
/// ICRF. One interpolation interval for each stretch (rows where they begin, and the number of rows at the end).
/// SPICE's quaternion is scalar first and of the matrix to c from J2000: (w, −x, −y, −z) of q_in_c; its angular
/// velocity is in J2000 axes.
[[nodiscard]] std::string format_ck(const AttitudeHistory& attitude, std::span<const Eigen::Vector3d> rate_rad_s,
                                    const SpiceClock& clock, const SpiceObject& object,
                                    std::span<const std::size_t> stretches);
/// Text kernels.
[[nodiscard]] std::string format_sclk(const SpiceClock& clock, const SpiceObject& object);
[[nodiscard]] std::string format_ck_frames(const SpiceObject& object);  ///< Frame c of the CK.
/// Frame c, the case axes of each gyro as TK frame (class 4) relative to it, and the calibration as pool variables of
/// these frames.
[[nodiscard]] std::string format_calibration_frames(const Calibration& calibration, const SpiceObject& object);

}  // namespace trihedron::io
