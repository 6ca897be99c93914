// The drift models as records name them, the core computes them and the simulator flies them.

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/prior.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/harmonics.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int kPoints = 100;

MatrixXd basis_of(const DriftModel& model, const Vector3d& h) {
  Columns<kMaxDriftColumns> columns;
  model.basis(h, {}, columns.view(model.columns()));
  return columns.first(model.size());
}

/// What moves the momentum, at directions all round.
MatrixXd across_the_sphere(const DriftModel& model) {
  MatrixXd rows(3 * kPoints, model.size());
  sim::Stream stream(3, sim::Source::kKappa);
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d h = stream.direction();
    const MatrixXd basis = basis_of(model, h);
    rows.middleRows<3>(3L * i) = basis - h * (h.transpose() * basis);
  }
  return rows;
}

std::vector<DriftModelId> all_models() {
  std::vector<DriftModelId> models{kEsg7, kEsg20};
  for (int degree = 1; degree <= DriftModelId::kMaxDegree; ++degree) {
    models.push_back(vsh(degree));
  }
  return models;
}

TEST(DriftModel, ContainsEq1AsItIs) {
  for (const DriftModelId& id : all_models()) {
    const DriftModel model(id, {});
    sim::Stream stream(4, sim::Source::kKappa);
    for (int i = 0; i < 20; ++i) {
      const Vector3d h = stream.direction();
      EXPECT_EQ(basis_of(model, h).leftCols<Esg7::kSize>(), Esg7::basis<double>(h)) << name_of(id);
    }
    for (int k = 0; k < Esg7::kSize; ++k) {
      EXPECT_EQ(coefficients_of(id)[static_cast<std::size_t>(k)], DriftCoefficient::of_eq1(k)) << name_of(id);
    }
  }
}

/// Files name the coefficients in this order, and the estimators hold them so.
TEST(DriftModel, HasItsMembersInTheOrderOfItsCoefficients) {
  for (const DriftModelId& id : all_models()) {
    const DriftModel model(id, {});
    const std::vector<DriftCoefficient> coefficients = coefficients_of(id);
    ASSERT_EQ(model.size(), id.size());
    ASSERT_EQ(coefficients.size(), static_cast<std::size_t>(model.size())) << name_of(id);
    for (int i = 0; i < model.size(); ++i) {
      EXPECT_EQ(model.member(i), coefficients[static_cast<std::size_t>(i)]) << name_of(id) << " " << i;
    }
  }
}

/// Up to a degree there are 2 n (n + 2) fields. With eq. (1) there are as many from degree 4 on; below it adds what it
/// has of higher degree.
TEST(DriftModel, IsCompleteWithoutSayingAnythingTwice) {
  const std::array<int, 8> sizes = {6 + 7, 16 + 3, 30 + 1, 48, 70, 96, 126, 160};
  for (int degree = 1; degree <= DriftModelId::kMaxDegree; ++degree) {
    const DriftModel model(vsh(degree), {});
    EXPECT_EQ(model.size(), sizes[static_cast<std::size_t>(degree - 1)]);
    EXPECT_EQ(across_the_sphere(model).colPivHouseholderQr().rank(), model.size());
  }
}

TEST(DriftModel, IsThatOfTheSimulator) {
  const DriftModel model(kLargestDriftModel, {});
  const std::vector<DriftCoefficient> coefficients = coefficients_of(kLargestDriftModel);
  sim::Stream stream(5, sim::Source::kKappa);
  int seen = 0;
  for (int degree = 1; degree <= DriftModelId::kMaxDegree; ++degree) {
    for (int order = -degree; order <= degree; ++order) {
      for (const auto potential : {DriftHarmonic::Potential::kW, DriftHarmonic::Potential::kD}) {
        const DriftHarmonic member{potential, degree, order, 1};
        std::vector<DriftHarmonic> its{member};
        if (degree == 4 && order == 4 &&
            potential == DriftHarmonic::Potential::kW) {  // what k0 leaves of (4, 0) and (4, 4)
          its = {{potential, 4, 4, std::sqrt(7.0 / 12)}, {potential, 4, 0, -std::sqrt(5.0 / 12)}};
        }
        const auto its_member =
            potential == DriftHarmonic::Potential::kW ? DriftCoefficient::Member::kW : DriftCoefficient::Member::kD;
        const DriftCoefficient coefficient{its_member, static_cast<std::int8_t>(degree),
                                           static_cast<std::int8_t>(order)};
        const auto found = std::ranges::find(coefficients, coefficient);
        if (found == coefficients.end()) {
          continue;
        }
        ++seen;
        const Vector3d h = stream.direction();
        const Vector3d column = basis_of(model, h).col(found - coefficients.begin());
        EXPECT_LT((column - h * h.dot(column) - sim::HarmonicField(its).rate(h)).norm(), 1e-13) << name(member);
      }
    }
  }
  EXPECT_EQ(seen, model.size() - Esg7::kSize);
}

/// A pass that tells nothing of single coefficients.
PassSettings with_common_sigma(double sigma_rad_s) {
  PassSettings settings;
  settings.gyros.resize(2);
  for (GyroPrior& gyro : settings.gyros) {
    gyro.drift_common_sigma_rad_s = sigma_rad_s;
    gyro.alignment_sigma_rad.setConstant(1e-2);
  }
  return settings;
}

Eigen::VectorXd prior_sigmas(const PassSettings& settings, const DriftModelId& model) {
  const Layout layout{.drift_model = model};
  return prior_of(settings, layout)
      .covariance.diagonal()
      .cwiseSqrt()
      .segment(layout.drift(0) - layout.dynamic(), layout.drift_size());
}

TEST(DriftModel, TakesFurtherMembersToBeTheSmallerTheFasterTheyChange) {
  const PassSettings settings = with_common_sigma(1);
  const Eigen::VectorXd by_degree_3 = prior_sigmas(settings, vsh(3));
  EXPECT_DOUBLE_EQ(by_degree_3(0), 1);
  EXPECT_DOUBLE_EQ(by_degree_3(Esg7::kSize), 0.05);
  EXPECT_DOUBLE_EQ(by_degree_3(by_degree_3.size() - 1), 0.05 * std::sqrt(0.5));  // √(2·3 / 3·4)
  const Eigen::VectorXd of_esg20 = prior_sigmas(settings, kEsg20);
  EXPECT_LT((of_esg20.tail(13).array() / 0.05 - 1).abs().maxCoeff(), 1e-15);  // all alike
}

TEST(DriftModel, HasAPriorOfEachCoefficientThatThePassTellsOf) {
  PassSettings settings = with_common_sigma(1e-6);
  const std::vector<DriftCoefficient> coefficients = coefficients_of(vsh(2));
  settings.gyros[1].drift_rad_s[coefficients[10]] = 3e-8;
  settings.gyros[1].drift_sigma_rad_s[coefficients[12]] = 4e-9;
  const Layout layout{.drift_model = vsh(2)};
  const Prior prior = prior_of(settings, layout);
  EXPECT_EQ(prior.gyros[1].drift_rad_s(10), 3e-8);
  EXPECT_EQ(prior.gyros[1].drift_rad_s.cwiseAbs().sum(), 3e-8);
  EXPECT_EQ(prior.gyros[0].drift_rad_s.cwiseAbs().sum(), 0);
  const int row = layout.drift(1) - layout.dynamic() + 12;
  EXPECT_DOUBLE_EQ(prior.covariance(row, row), 16e-18);
  EXPECT_THROW(static_cast<void>(prior_of(settings, Layout{})), SetupError);
}

TEST(DriftModel, RefusesDegreesThatThereAreNot) {
  for (const int degree : {0, DriftModelId::kMaxDegree + 1, 200}) {
    EXPECT_THROW(refuse_unknown(vsh(degree)), SetupError) << degree;
  }
  for (const DriftModelId& id : all_models()) {
    EXPECT_NO_THROW(refuse_unknown(id)) << name_of(id);
  }
  EXPECT_EQ(vsh(DriftModelId::kMaxDegree), kLargestDriftModel);
}

}  // namespace
}  // namespace trihedron::ground
