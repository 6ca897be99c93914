#pragma once
/// The best attitude that there is to compare with.

#include <Eigen/Geometry>
#include <vector>

#include "trihedron/ground/evaluate/attitude_evaluation.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

struct Reference {
  ReferenceKind kind = ReferenceKind::kTruth;
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;
  Eigen::Vector3d sigma_rad{0, 0, 0};  ///< of its own error about c x, y, z
};

/// The truth, which may be null, or else these fixes of the first star tracker.
[[nodiscard]] Reference best_reference(const PassSettings& settings, const Truth* truth,
                                       const StarTrackerTelemetry& fixes);

[[nodiscard]] AttitudeEvaluation evaluate_against(const Reference& reference, const AttitudeHistory& attitude,
                                                  Time epoch, double limit_rad);

}  // namespace trihedron::ground
