#include "trihedron/core/outlier_gate.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace trihedron {
namespace {

TEST(OutlierGate, RejectsAboveTheGateAndWhatIsNoNumber) {
  OutlierGate gate(30, 5, 10);
  EXPECT_EQ(gate.judge(30), FixStatus::kUsed);
  EXPECT_EQ(gate.judge(30.1), FixStatus::kRejectedByGate);
  EXPECT_EQ(gate.judge(std::numeric_limits<double>::quiet_NaN()), FixStatus::kRejectedByGate);
  EXPECT_EQ(gate.rejections_in_a_row(), 2);
  EXPECT_EQ(gate.judge(3), FixStatus::kUsed);
  EXPECT_EQ(gate.rejections_in_a_row(), 0);
}

TEST(OutlierGate, ReopensAfterARunAndRestartsAfterAnotherSoon) {
  OutlierGate gate(30, 3, 10);
  const auto run = [&] {
    EXPECT_EQ(gate.judge(100), FixStatus::kRejectedByGate);
    EXPECT_EQ(gate.judge(100), FixStatus::kRejectedByGate);
    return gate.judge(100);
  };
  EXPECT_EQ(run(), FixStatus::kUsedAfterReopening);
  EXPECT_EQ(run(), FixStatus::kRestarted);
  // Ten good fixes later the suspicion is over.
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(gate.judge(4), FixStatus::kUsed);
  }
  EXPECT_EQ(run(), FixStatus::kUsedAfterReopening);
}

}  // namespace
}  // namespace trihedron
