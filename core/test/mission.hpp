#pragma once
/// Flights of any layout and at any rates, in which everything that the estimator has a state for is at work: the truth
/// is drawn from the prior that the estimator is told.

#include <Eigen/Core>
#include <vector>

#include "flight.hpp"

namespace trihedron::test {

struct MissionPlan {
  Layout layout{};
  double duration_s = 300;
  double gyro_period_s = 0.125;
  double fix_period_s = 3;  ///< of each star tracker; they look one after the other
  double slews_rad = 0.5;
  double slews_from_s = -1000;   ///< before the beginning: a clock that is off must not see it
  double calibration_sigma = 1;  ///< prior 1-sigma of alignments and drift coefficients, as part of the usual one
  unsigned seed = 1;
};

struct Mission {
  FullGiven given;
  FullEstimator::Gyros truth;  ///< at the end; drift_rad_s of all columns
  SharedStates shared;
  std::vector<GyroSample> samples;
  std::vector<StarFix> fixes;
  std::vector<Eigen::Matrix3d> C_in_c_at_samples;
  std::vector<Eigen::VectorXd> wandering_at_samples;  ///< of all gyros

  explicit Mission(const MissionPlan& plan);

  /// Errors of all states, truth − estimate, in the order of the layout: of constants, and of the drift that wanders
  /// at the sample `last_fix`. The directions' are left zero.
  [[nodiscard]] Eigen::VectorXd errors(const FullEstimator& estimator, std::size_t last_fix) const;

  /// Flown to the end, every fix dealt with as soon as it is due.
  template <class OnBoard>
  void fly(OnBoard& on_board, const OnReport& on_report = kIgnore) const {
    const OnReport with_all_due = [&](const StepReport& report) {
      on_report(report);
      for (StepReport more = report; more.more_due;) {
        more = on_board.carry_on();
        on_report(more);
      }
    };
    test::fly(samples, fixes, on_board, with_all_due);
  }
};

}  // namespace trihedron::test
