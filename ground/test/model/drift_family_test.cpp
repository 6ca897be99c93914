#include "model/drift_family.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "trihedron/core/drift.hpp"
#include "trihedron/sim/harmonics.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int kPoints = 100;

/// What moves the momentum, at directions all round.
MatrixXd across_the_sphere(const DriftFamily& family) {
  MatrixXd rows(3 * kPoints, family.size());
  sim::Stream stream(3, sim::Source::kKappa);
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d h = stream.direction();
    const MatrixXd basis = family.basis(h);
    rows.middleRows<3>(3L * i) = basis - h * (h.transpose() * basis);
  }
  return rows;
}

TEST(DriftFamily, ContainsEq1AsItIs) {
  const DriftFamily family = *DriftFamily::named("vsh:6");
  sim::Stream stream(4, sim::Source::kKappa);
  for (int i = 0; i < 20; ++i) {
    const Vector3d h = stream.direction();
    EXPECT_EQ(family.basis(h).leftCols<Esg7::kSize>(), Esg7::basis<double>(h));
  }
  for (int k = 0; k < Esg7::kSize; ++k) {
    EXPECT_EQ(family.names()[static_cast<std::size_t>(k)], Esg7::kNames[static_cast<std::size_t>(k)]);
  }
}

/// Up to a degree there are 2 n (n + 2) fields. With eq. (1) there are as many from degree 4 on; below it adds what it
/// has of higher degree.
TEST(DriftFamily, IsCompleteWithoutSayingAnythingTwice) {
  const std::array<int, 6> sizes = {6 + 7, 16 + 3, 30 + 1, 48, 70, 96};
  for (int degree = 1; degree <= DriftFamily::kMaxDegree; ++degree) {
    const DriftFamily family = *DriftFamily::named("vsh:" + std::to_string(degree));
    EXPECT_EQ(family.size(), sizes[static_cast<std::size_t>(degree - 1)]);
    EXPECT_EQ(across_the_sphere(family).colPivHouseholderQr().rank(), family.size());
  }
}

TEST(DriftFamily, GoesUpToTheLargestModel) {
  EXPECT_EQ(kLargestDriftModel, "vsh:" + std::to_string(DriftFamily::kMaxDegree));
  EXPECT_FALSE(DriftFamily::named("vsh:" + std::to_string(DriftFamily::kMaxDegree + 1)));
}

TEST(DriftFamily, IsThatOfTheSimulator) {
  const DriftFamily family = *DriftFamily::named("vsh:6");
  sim::Stream stream(5, sim::Source::kKappa);
  int seen = 0;
  for (int degree = 1; degree <= DriftFamily::kMaxDegree; ++degree) {
    for (int order = -degree; order <= degree; ++order) {
      for (const auto potential : {DriftHarmonic::Potential::kW, DriftHarmonic::Potential::kD}) {
        const DriftHarmonic member{potential, degree, order, 1};
        const auto found = std::ranges::find(family.names(), name(member));
        if (found == family.names().end()) {
          continue;
        }
        ++seen;
        const Vector3d h = stream.direction();
        const Vector3d column = family.basis(h).col(found - family.names().begin());
        EXPECT_LT((column - h * h.dot(column) - sim::HarmonicField({member}).rate(h)).norm(), 1e-13) << *found;
      }
    }
  }
  EXPECT_EQ(seen, family.size() - Esg7::kSize);
}

TEST(DriftFamily, TakesFurtherMembersToBeTheSmallerTheFasterTheyChange) {
  const DriftFamily family = *DriftFamily::named("vsh:3");
  EXPECT_EQ(family.prior_factor(0), 1);
  EXPECT_EQ(family.prior_factor(Esg7::kSize), DriftFamily::named("esg20")->prior_factor(Esg7::kSize));
  EXPECT_DOUBLE_EQ(family.prior_factor(family.size() - 1), 0.05 * std::sqrt(0.5));  // √(2·3 / 3·4)
}

TEST(DriftFamily, KnowsNoOtherNames) {
  for (const char* name : {"", "esg8", "vsh", "vsh:", "vsh:0", "vsh:7", "vsh:-1", "vsh:2.5", "vsh:3 ", "auto"}) {
    EXPECT_FALSE(DriftFamily::named(name)) << name;
  }
}

}  // namespace
}  // namespace trihedron::ground
