#include "trihedron/ground/model/names.hpp"

#include "model/drift_family.hpp"

namespace trihedron::ground {

bool is_drift_model(const std::string& name) { return name == kAutoDriftModel || DriftFamily::named(name).has_value(); }

const char* name_of(FixStatus status) {
  switch (status) {
    case FixStatus::kNone:
      return "none";
    case FixStatus::kPending:
      return "pending";
    case FixStatus::kStarted:
      return "started the filter";
    case FixStatus::kUsed:
      return "used";
    case FixStatus::kUsedAfterReopening:
      return "used after reopening";
    case FixStatus::kRestarted:
      return "used, filter restarted";
    case FixStatus::kRejectedNotRotation:
      return "rejected: not a rotation";
    case FixStatus::kRejectedOutOfOrder:
      return "rejected: out of order";
    case FixStatus::kRejectedNoGyro:
      return "rejected: no gyro samples round it";
    case FixStatus::kRejectedUnknownHead:
      return "rejected: of an unknown star tracker";
    case FixStatus::kRejectedBacklog:
      return "rejected: too many waiting";
    case FixStatus::kRejectedGeometry:
      return "rejected: momenta nearly parallel";
    case FixStatus::kRejectedTooFewGyros:
      return "rejected: too few gyros can be used";
    case FixStatus::kRejectedByGate:
      return "rejected: outlier";
  }
  return "unknown";
}

const char* name_of(SampleStatus status) {
  switch (status) {
    case SampleStatus::kUsed:
      return "used";
    case SampleStatus::kRejectedNotDirection:
      return "rejected: not a direction";
    case SampleStatus::kRejectedOutOfOrder:
      return "rejected: out of order";
    case SampleStatus::kRejectedGeometry:
      return "rejected: momenta nearly parallel";
    case SampleStatus::kRejectedTooFewGyros:
      return "rejected: too few gyros can be used";
    case SampleStatus::kUsedAfterClockSetBack:
      return "used after the clock was set back";
  }
  return "unknown";
}

const char* name_of(GyroState state) {
  switch (state) {
    case GyroState::kUsed:
      return "used again";
    case GyroState::kStuck:
      return "stuck";
    case GyroState::kIsolated:
      return "left out for good";
  }
  return "unknown";
}

}  // namespace trihedron::ground
