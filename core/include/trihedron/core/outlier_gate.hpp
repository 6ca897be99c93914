#pragma once

#include <algorithm>

#include "trihedron/core/calibration.hpp"

namespace trihedron {

/// Rejects fixes whose NIS is above a gate, and cannot lock out good ones: after a run of rejections the model was
/// wrong, not the tracker, and the directions are set free; when that happens again soon, the filter begins anew.
class OutlierGate {
 public:
  OutlierGate() = default;
  OutlierGate(double gate_nis, int reopen_after_rejections, int restart_within_fixes)
      : gate_nis_(gate_nis), reopen_after_(reopen_after_rejections), restart_within_(restart_within_fixes) {}

  /// kUsed, kRejectedByGate, kUsedAfterReopening or kRestarted: what to do with the fix.
  [[nodiscard]] FixStatus judge(double nis) {
    FixStatus status = FixStatus::kUsed;
    if (!(nis <= gate_nis_)) {
      if (++rejections_in_a_row_ < reopen_after_) {
        return FixStatus::kRejectedByGate;
      }
      status = under_suspicion_ > 0 ? FixStatus::kRestarted : FixStatus::kUsedAfterReopening;
      under_suspicion_ = restart_within_ + 1;
    }
    rejections_in_a_row_ = 0;
    under_suspicion_ = std::max(under_suspicion_ - 1, 0);
    return status;
  }
  [[nodiscard]] int rejections_in_a_row() const { return rejections_in_a_row_; }

 private:
  double gate_nis_ = 0;
  int reopen_after_ = 0;
  int restart_within_ = 0;
  int rejections_in_a_row_ = 0;
  int under_suspicion_ = 0;
};

}  // namespace trihedron
