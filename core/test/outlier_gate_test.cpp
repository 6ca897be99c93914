#include "trihedron/core/outlier_gate.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace trihedron {
namespace {

constexpr double kSmall_rad = 1e-3;
constexpr double kLie_rad = 0.05;

/// With the set-up that it is asked by.
class Gate : public OutlierGate {
 public:
  Gate(int reopen_after, int reopen_after_jump) {
    setup_.gate_nis = 30;
    setup_.reopen_after_rejections = reopen_after;
    setup_.reopen_after_jump_rejections = reopen_after_jump;
    setup_.restart_within_fixes = 10;
  }
  FixStatus judge(double nis, double misfit_rad, int freedom = kPairComponents, bool is_of_gyros = false) {
    return OutlierGate::judge(setup_, nis, misfit_rad, freedom, is_of_gyros);
  }

 private:
  CalibrationSetup setup_;
};

/// How many of the same misfit, one each 3 s, are rejected before one is used.
int rejections(Gate& gate, double misfit_rad) {
  int count = 0;
  while (gate.judge(100, misfit_rad) == FixStatus::kRejectedByGate) {
    gate.elapse(3);
    ++count;
  }
  return count;
}

TEST(GateOfFreedom, IsPassedAsOftenByGoodMeasurements) {
  // χ² quantiles of the probability that 4 degrees of freedom leave above 30: 4.9e-6.
  EXPECT_DOUBLE_EQ(gate_of_freedom(4, 30), 30);
  EXPECT_NEAR(gate_of_freedom(1, 30), 20.9, 1.2);
  EXPECT_NEAR(gate_of_freedom(2, 30), 24.5, 0.6);
  EXPECT_NEAR(gate_of_freedom(3, 30), 27.4, 0.3);
  EXPECT_NEAR(gate_of_freedom(6, 30), 34.6, 0.5);
}

TEST(OutlierGate, DoesNotPutAJumpDownToTheStarTrackerWhereTheGyrosContradict) {
  for (const bool is_of_gyros : {false, true}) {
    Gate gate(5, 50);
    EXPECT_EQ(gate.judge(3, kSmall_rad), FixStatus::kUsed);
    int rejected = 0;
    while (gate.judge(100, kLie_rad, kPairComponents, is_of_gyros) == FixStatus::kRejectedByGate) {
      EXPECT_EQ(gate.jumped(), !is_of_gyros);
      ++rejected;
    }
    EXPECT_EQ(rejected, is_of_gyros ? 4 : 49);
  }
}

TEST(OutlierGate, RejectsAboveTheGateAndWhatIsNoNumber) {
  Gate gate(5, 50);
  EXPECT_EQ(gate.judge(29.9, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(gate.judge(30.1, kSmall_rad), FixStatus::kRejectedByGate);
  EXPECT_FALSE(gate.jumped());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(gate.judge(nan, nan), FixStatus::kRejectedByGate);
  EXPECT_TRUE(gate.jumped());
  EXPECT_EQ(gate.rejections_in_a_row(), 2);
  EXPECT_EQ(gate.judge(3, kSmall_rad), FixStatus::kUsed);
  EXPECT_FALSE(gate.jumped());
  EXPECT_EQ(gate.rejections_in_a_row(), 0);
}

TEST(OutlierGate, ReopensAfterARunAndRestartsAfterAnotherSoon) {
  Gate gate(3, 50);
  const auto run = [&] {
    EXPECT_EQ(gate.judge(100, kSmall_rad), FixStatus::kRejectedByGate);
    EXPECT_EQ(gate.judge(100, kSmall_rad), FixStatus::kRejectedByGate);
    return gate.judge(100, kSmall_rad);
  };
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(run(), FixStatus::kUsedAfterReopening);
  EXPECT_EQ(run(), FixStatus::kRestarted);
  // Ten good fixes later the suspicion is over.
  for (const int good : {9, 10}) {
    for (int i = 0; i < good; ++i) {
      EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
    }
    EXPECT_EQ(run(), good < 10 ? FixStatus::kRestarted : FixStatus::kUsedAfterReopening);
  }
}

TEST(OutlierGate, RestartsAtOnceWhereTheNextFixContradictsAStart) {
  Gate gate(3, 50);
  for (int i = 0; i < OutlierGate::kMostRestartsAtOnce; ++i) {
    EXPECT_EQ(gate.judge(100, kLie_rad), FixStatus::kRestarted);
    EXPECT_FALSE(gate.restarted_recently());
  }
  // A start that no fix ever confirms is judged as any other; a jump from it is none.
  EXPECT_EQ(rejections(gate, kLie_rad), 2);

  Gate confirmed(3, 50);
  EXPECT_EQ(confirmed.judge(100, kLie_rad), FixStatus::kRestarted);
  EXPECT_EQ(confirmed.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(confirmed.judge(100, kSmall_rad), FixStatus::kRejectedByGate);
}

TEST(OutlierGate, WaitsLongerWhereTheMisfitHasJumped) {
  Gate gate(3, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(rejections(gate, kLie_rad), 49);
  // What it has reopened to is in doubt until a fix agrees with it.
  EXPECT_EQ(rejections(gate, kLie_rad), 2);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(rejections(gate, kLie_rad), 49);
}

TEST(OutlierGate, DoesNotWaitLongerOnceTheMisfitIsBackAsFarAsDriftMayTell) {
  Gate gate(3, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(gate.judge(100, kLie_rad), FixStatus::kRejectedByGate);
  EXPECT_EQ(rejections(gate, kSmall_rad + 0.9 * OutlierGate::kLargestStep_rad), 2);
}

TEST(OutlierGate, WaitsLongerWhereASmallOutlierWentBefore) {
  Gate gate(3, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(gate.judge(100, kSmall_rad), FixStatus::kRejectedByGate);
  EXPECT_EQ(rejections(gate, kLie_rad), 48);
}

TEST(OutlierGate, DoesNotWaitLongerForAnOutlierInARun) {
  Gate gate(5, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  for (const double misfit_rad : {kSmall_rad, kSmall_rad, kLie_rad, kSmall_rad, kSmall_rad, kSmall_rad, kSmall_rad}) {
    EXPECT_EQ(gate.judge(100, misfit_rad), FixStatus::kRejectedByGate);
  }
  EXPECT_EQ(gate.judge(100, kSmall_rad), FixStatus::kUsedAfterReopening);
}

TEST(OutlierGate, WaitsLongerWhereTheMisfitComesBackNowAndThen) {
  Gate gate(3, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  int count = 0;
  while (gate.judge(100, count % 3 == 0 ? kLie_rad : kSmall_rad) == FixStatus::kRejectedByGate) {
    ++count;
  }
  EXPECT_EQ(count, 49);
}

TEST(OutlierGate, IsAsWideForEachNumberOfComponents) {
  Gate gate(5, 50);
  EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
  EXPECT_EQ(gate.judge(33, kSmall_rad), FixStatus::kRejectedByGate);
  EXPECT_EQ(gate.judge(33, kSmall_rad, 6), FixStatus::kUsed);
}

TEST(OutlierGate, DoesNotTakeWhatDriftMayDoInTheTimeForAJump) {
  for (const double since_s : {3.0, 6000.0}) {
    Gate gate(3, 50);
    EXPECT_EQ(gate.judge(4, kSmall_rad), FixStatus::kUsed);
    gate.elapse(since_s);
    EXPECT_EQ(rejections(gate, kLie_rad), since_s > 5000 ? 2 : 49) << since_s;
  }
  // Nor what grows step by step.
  Gate gate(10, 50);
  EXPECT_EQ(gate.judge(4, 0), FixStatus::kUsed);
  int count = 0;
  for (double misfit_rad = 2e-3; gate.judge(100, misfit_rad) == FixStatus::kRejectedByGate; misfit_rad += 2e-3) {
    ++count;
  }
  EXPECT_EQ(count, 9);
}

}  // namespace
}  // namespace trihedron
