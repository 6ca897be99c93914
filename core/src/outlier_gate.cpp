#include "trihedron/core/outlier_gate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trihedron/core/elementary.hpp"

namespace trihedron {

double gate_of_freedom(int freedom, double gate_nis) {
  const double variance = 2.0 / (9 * freedom);
  constexpr double kItsVariance = 2.0 / (9 * kPairComponents);
  const double sigmas =
      (elementary::cube_root(gate_nis / kPairComponents) - (1 - kItsVariance)) / std::sqrt(kItsVariance);
  const double root = std::max(1 - variance + sigmas * std::sqrt(variance), 0.0);
  return freedom * root * root * root;
}

FixStatus OutlierGate::judge(const CalibrationSetup& setup, double nis, double misfit_rad, int freedom,
                             bool is_of_gyros) {
  const double largest_rad = kLargestStep_rad + kLargestRate_rad_s * since_fix_s_;
  const double before_rad = std::exchange(misfit_rad_, misfit_rad);
  const bool jumped_now = !(misfit_rad - before_rad <= largest_rad);
  since_fix_s_ = 0;
  FixStatus status = FixStatus::kUsed;
  if (!(nis <= gate_of_freedom(freedom, setup.gate_nis))) {
    if (restarts_at_once_left_ > 0) {
      --restarts_at_once_left_;
      misfit_rad_ = 0;
      return FixStatus::kRestarted;
    }
    look_for_jump(jumped_now, before_rad, largest_rad, setup.reopen_after_rejections);
    jumped_ = jumped_ && !is_of_gyros;
    if (++rejections_in_a_row_ < (jumped_ ? setup.reopen_after_jump_rejections : setup.reopen_after_rejections)) {
      return FixStatus::kRejectedByGate;
    }
    status = under_suspicion_ > 0 ? FixStatus::kRestarted : FixStatus::kUsedAfterReopening;
    restarted_ = status == FixStatus::kRestarted;
    under_suspicion_ = setup.restart_within_fixes;
    misfit_rad_ = 0;
  } else {
    under_suspicion_ = std::max(under_suspicion_ - 1, 0);
  }
  confirmed_ = status == FixStatus::kUsed;
  restarts_at_once_left_ = 0;
  jumped_ = false;
  rejections_in_a_row_ = 0;
  return status;
}

void OutlierGate::look_for_jump(bool jumped_now, double before_rad, double largest_rad, int reopen_after) {
  if (jumped_now && confirmed_) {
    before_jump_rad_ = jumped_ ? before_jump_rad_ : before_rad;
    jumped_ = true;
    back_ = 0;
  } else if (jumped_) {
    back_ = misfit_rad_ <= before_jump_rad_ + largest_rad ? back_ + 1 : 0;
    jumped_ = back_ < reopen_after;
  }
}

}  // namespace trihedron
