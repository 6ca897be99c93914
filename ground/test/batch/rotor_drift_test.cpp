#include "batch/rotor_drift.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "trihedron/core/layout.hpp"

namespace trihedron::ground {
namespace {

TEST(RotorDrift, IsTheDriftModelWithItsCoefficients) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const DriftModelId& id : {kEsg7, kEsg20, vsh(1), vsh(3), vsh(8)}) {
    for (const FurtherStates& further :
         {FurtherStates{}, FurtherStates{.wandering_drift = true}, FurtherStates{.coefficient_change = true},
          FurtherStates{.orbital_drift = true}, FurtherStates{.polhode = true}, kAllFurtherStates}) {
      const DriftModel model(id, further);
      Eigen::VectorXd coefficients = Eigen::VectorXd::NullaryExpr(model.columns(), [&] { return normal(random); });
      if (further.wandering_drift) {
        coefficients.segment<3>(model.size()).setZero();  // which it leaves to others
      }
      const RotorDrift rotor(model, coefficients.data());
      for (int i = 0; i < 20; ++i) {
        const Eigen::Vector3d h = i < 3 ? Eigen::Vector3d::Unit(i)  // poles among them
                                        : Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
        const DriftTime time{normal(random), normal(random), normal(random), normal(random), normal(random)};
        const Eigen::Vector3d across = model.rate(h, time, coefficients.data()).cross(h);
        // Parts along h move nothing, and depend on how the polynomials are written.
        EXPECT_LT((rotor.rate(h, time).cross(h) - across).norm(), 1e-13 * (1 + coefficients.norm())) << i;
      }
    }
  }
}

}  // namespace
}  // namespace trihedron::ground
