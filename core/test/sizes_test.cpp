// What the on-board object takes of the memory.

#include <gtest/gtest.h>

#include <cstddef>
#include <iomanip>
#include <iostream>

#include "flight.hpp"

namespace trihedron {
namespace {

struct Part {
  const char* name;
  std::size_t smallest;
  std::size_t largest;
};

using Small = test::PairEstimator;
using Large = test::FullEstimator;
const Part kParts[] = {
    {"on-board object", sizeof(PairOnBoard), sizeof(FullOnBoard)},
    {"  intake", sizeof(Intake<Small::Gyros::capacity()>), sizeof(Intake<Large::Gyros::capacity()>)},
    {"  queue of fixes", sizeof(FixQueue<Small::kStarTrackers>), sizeof(FixQueue<Large::kStarTrackers, true>)},
    {"  frozen fixes", sizeof(FrozenFixes<Small::kStarTrackers, Small::Gyros::capacity()>),
     sizeof(FrozenFixes<Large::kStarTrackers, Large::Gyros::capacity()>)},
    {"  readings", sizeof(Readings<Small::Gyros::capacity()>), sizeof(Readings<Large::Gyros::capacity()>)},
    {"  schedule", sizeof(Schedule), sizeof(Schedule)},
    {"  estimator", sizeof(Small), sizeof(Large)},
    {"    set-up", sizeof(CalibrationSetup), sizeof(CalibrationSetup)},
    {"    drift model", sizeof(DriftModel), sizeof(DriftModel)},
    {"    root of the covariance", sizeof(Small::Errors), sizeof(Large::Errors)},
    {"    gyros", sizeof(Small::Gyros), sizeof(Large::Gyros)},
    {"    sensitivities", sizeof(Small::Since), sizeof(Large::Since)},
    {"  navigator", sizeof(Navigator<Small>), sizeof(Navigator<Large>)},
    {"report of a step", sizeof(StepReport), sizeof(StepReport)},
};

TEST(OnBoard, OfAPairFitsInto32KiB) {
  std::cout << std::left << std::setw(28) << "bytes" << std::right << std::setw(12) << "smallest" << std::setw(12)
            << "largest" << '\n';
  for (const Part& part : kParts) {
    std::cout << std::left << std::setw(28) << part.name << std::right << std::setw(12) << part.smallest
              << std::setw(12) << part.largest << '\n';
  }
  std::cout << "smallest: " << kPairCapacity.gyros << " gyros, " << kPairCapacity.states
            << " states; largest: " << kFullCapacity.gyros << " gyros, " << kFullCapacity.states << " states\n";
  EXPECT_LE(sizeof(PairOnBoard), 32U * 1024);
}

}  // namespace
}  // namespace trihedron
