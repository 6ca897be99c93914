#include "trihedron/core/frozen_fixes.hpp"

#include "trihedron/core/cholesky.hpp"

namespace trihedron {

bool shows_turn(const Eigen::Vector3d& before_c, const Eigen::Vector3d& now_c, const Eigen::Matrix3d& R_c,
                double reading_rad, double gate) {
  if (!(before_c.dot(now_c) > 0)) {
    return true;  // by a right angle and more
  }
  // The attitudes of two equal quaternions differ by no more than the noises of two fixes. Of a turn the momentum shows
  // the part across itself.
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - before_c * before_c.transpose();
  Eigen::Matrix3d covariance = 2 * across * R_c * across;
  covariance.diagonal().array() += reading_rad * reading_rad;
  Eigen::Vector3d turn = before_c.cross(now_c);
  solve_lower(matrix_of(cholesky_root<3>(covariance)), turn);
  return turn.squaredNorm() > gate;
}

}  // namespace trihedron
