#pragma once
/// Errors of fixes and readings that a pass may contain, as columns beside the rows of its fixes. Each moves the
/// directions as a small rotation of the cases would, an alignment. Derived in docs/mathematics.md, section 12.

#include <Eigen/Core>

#include "batch/pass_problem.hpp"
#include "trihedron/core/drift.hpp"

namespace trihedron::ground {

/// Sine and cosine about three axes of c.
inline constexpr Eigen::Index kOfSineAndCosine = 6;

/// Where the columns of each kind of error are.
struct ErrorColumns {
  int gyros;

  /// By a velocity that is constant, and by two at orbital period, over the speed of light, in axes.
  static constexpr int kOfAberration = 9;
  static constexpr Eigen::Index kAberration = 0;
  /// Rotations of the star tracker that go to and fro at multiples of the orbital rate, from 2 on.
  static constexpr int kMultiplesOfRate = 2;
  [[nodiscard]] static Eigen::Index multiple(int i) { return kOfAberration + kOfSineAndCosine * i; }

  /// What the scales of a gyro's direction cosines are off 1, and the angles between their axes off right angles.
  static constexpr int kOfReadout = 6;
  [[nodiscard]] static Eigen::Index readout(int gyro) { return multiple(kMultiplesOfRate) + kOfGyro * gyro; }
  /// Rotations of its case that go to and fro at the orbital rate.
  [[nodiscard]] static Eigen::Index case_of(int gyro) { return readout(gyro) + kOfReadout; }
  /// Errors of its readings as functions of the direction: fields on the sphere up to this degree.
  static constexpr DriftModelId kFields = vsh(4);
  [[nodiscard]] static Eigen::Index fields(int gyro) { return case_of(gyro) + kOfSineAndCosine; }

  [[nodiscard]] Eigen::Index size() const { return readout(gyros); }

 private:
  static constexpr Eigen::Index kOfGyro = kOfReadout + kOfSineAndCosine + kFields.size();
};

/// All of them for one fix, then `more` columns of zero. `fields`: of ErrorColumns::kFields, with any coefficients.
[[nodiscard]] Eigen::MatrixXd shapes_of_errors(const CalibrationSetup& setup, const DriftModel& fields,
                                               const PassProblem::Moment& moment, const Layout& layout,
                                               const Eigen::MatrixXd& rows, Eigen::Index more);

/// Adds the shapes of aberration to those of a fix, ErrorColumns::kOfAberration columns.
void add_aberration(const PassProblem::Moment& moment, double phase_rad, const Eigen::MatrixXd& rows,
                    const Layout& layout, Eigen::Ref<Eigen::MatrixXd> shapes);

/// What may be expected of these, 1-sigma: the Earth's orbital velocity over that of light, and a spacecraft's.
[[nodiscard]] Eigen::VectorXd sigmas_of_aberration();

/// Adds an error of the star tracker at an angle's sine and cosine, kOfSineAndCosine columns: as alignments of all
/// gyros.
void add_error_at(double angle_rad, const Eigen::MatrixXd& rows, const Layout& layout,
                  Eigen::Ref<Eigen::MatrixXd> error);

/// Root mean square over the sphere of each member of the fields whose amplitude is 1; infinite for rotations, which
/// the alignment has.
[[nodiscard]] Eigen::VectorXd rms_of_fields();

}  // namespace trihedron::ground
