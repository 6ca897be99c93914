#include "trihedron/sim/harmonics.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <numbers>

#include "trihedron/core/drift.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;
using Potential = DriftHarmonic::Potential;

/// Directions where formulas in angles break down, then some at random.
std::vector<Vector3d> directions(int random = 20) {
  std::vector<Vector3d> d = {Vector3d::UnitX(),
                             Vector3d::UnitY(),
                             Vector3d::UnitZ(),
                             -Vector3d::UnitZ(),
                             Vector3d(1e-10, 0, 1).normalized(),
                             Vector3d(1, 1, 1).normalized()};
  Stream stream(1, Source::kKappa);
  for (int i = 0; i < random; ++i) {
    d.push_back(stream.direction());
  }
  return d;
}

Vector3d across(const Vector3d& h, const Vector3d& v) { return v - h * h.dot(v); }

TEST(Harmonics, LowDegreesAreTheTextbookPolynomials) {
  const HarmonicTable table(3);
  const double pi = std::numbers::pi;
  for (const Vector3d& h : directions()) {
    const auto y = table.at(h);
    EXPECT_NEAR(y(0, 0).value, std::sqrt(0.25 / pi), 1e-15);
    EXPECT_NEAR(y(1, -1).value, std::sqrt(0.75 / pi) * h.y(), 1e-15);
    EXPECT_NEAR(y(1, 0).value, std::sqrt(0.75 / pi) * h.z(), 1e-15);
    EXPECT_NEAR(y(1, 1).value, std::sqrt(0.75 / pi) * h.x(), 1e-15);
    EXPECT_NEAR(y(2, -2).value, std::sqrt(15 / pi) / 2 * h.x() * h.y(), 2e-15);
    EXPECT_NEAR(y(2, 0).value, std::sqrt(5 / pi) / 4 * (3 * h.z() * h.z() - 1), 2e-15);
    EXPECT_NEAR(y(2, 2).value, std::sqrt(15 / pi) / 4 * (h.x() * h.x() - h.y() * h.y()), 2e-15);
    EXPECT_NEAR(y(3, -2).value, std::sqrt(105 / pi) / 2 * h.x() * h.y() * h.z(), 2e-15);
  }
}

TEST(Harmonics, AreOrthonormal) {
  // Trapezium in azimuth and in-between points of a fine grid in z integrate polynomials of degree 8 to (1/2000)² / 24
  // × 72.
  constexpr int kDegree = 4;
  constexpr int kBands = 2000;
  constexpr int kAzimuths = 2 * kDegree + 1;
  const HarmonicTable table(kDegree);
  constexpr int kCount = (kDegree + 1) * (kDegree + 1);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(kCount, kCount);
  for (int i = 0; i < kBands; ++i) {
    const double z = -1 + (i + 0.5) * 2 / kBands;
    for (int j = 0; j < kAzimuths; ++j) {
      const double azimuth = 2 * std::numbers::pi * j / kAzimuths;
      const double r = std::sqrt(1 - z * z);
      const auto y = table.at(Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), z));
      Eigen::VectorXd values(kCount);
      for (int l = 0, k = 0; l <= kDegree; ++l) {
        for (int m = -l; m <= l; ++m, ++k) {
          values(k) = y(l, m).value;
        }
      }
      gram += values * values.transpose() * (2.0 / kBands * 2 * std::numbers::pi / kAzimuths);
    }
  }
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(kCount, kCount)).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(Harmonics, SatisfyTheAdditionTheoremUpToDegree20) {
  const HarmonicTable table(HarmonicTable::kMaxDegree);
  for (const Vector3d& h : directions()) {
    const auto y = table.at(h);
    for (int l = 0; l <= HarmonicTable::kMaxDegree; ++l) {
      double squares = 0;
      double slopes = 0;
      for (int m = -l; m <= l; ++m) {
        squares += std::pow(y(l, m).value, 2);
        slopes += y(l, m).gradient.squaredNorm();
      }
      const double expected = (2 * l + 1) / (4 * std::numbers::pi);
      // Rounding grows with the degree of the recurrence.
      EXPECT_NEAR(squares / expected, 1, 1e-13);
      EXPECT_NEAR(slopes / expected, l * (l + 1), 1e-12 * (1 + l * l));
    }
  }
}

TEST(Harmonics, GradientIsTheDerivativeAlongTheSphere) {
  const HarmonicTable table(8);
  const double step = 1e-5;
  for (const Vector3d& h : directions()) {
    const Vector3d u = h.unitOrthogonal();
    for (const Vector3d& tangent : {u, Vector3d(h.cross(u))}) {
      const auto ahead = table.at(Vector3d(std::cos(step) * h + std::sin(step) * tangent));
      const auto behind = table.at(Vector3d(std::cos(step) * h - std::sin(step) * tangent));
      for (int l = 0; l <= 8; ++l) {
        for (int m = -l; m <= l; ++m) {
          const double difference = (ahead(l, m).value - behind(l, m).value) / (2 * step);
          // l³ step² / 6 of truncation, 1e-16 / step of rounding, in units of Y ~ 1.
          EXPECT_NEAR(table.at(h)(l, m).gradient.dot(tangent), difference, 1e-7) << l << " " << m;
        }
      }
      EXPECT_NEAR(table.at(h)(8, 3).gradient.dot(h), 0, 1e-13);
    }
  }
}

TEST(Harmonics, FieldIsTheSumOfItsMembersHoweverTheyCome) {
  const HarmonicTable table(HarmonicTable::kMaxDegree);
  Stream stream(1, Source::kOutsideDrift);
  std::vector<DriftHarmonic> members;
  for (int i = 0; i < 200; ++i) {  // some twice
    const int degree = 1 + static_cast<int>(stream.uniform() * HarmonicTable::kMaxDegree);
    const int order = static_cast<int>(stream.uniform() * (2 * degree + 1)) - degree;
    members.push_back({stream.happens(0.5) ? Potential::kW : Potential::kD, degree, order, stream.normal()});
  }
  const HarmonicField field(members);
  for (const Vector3d& h : directions()) {
    const auto y = table.at(h);
    Vector3d expected = Vector3d::Zero();
    for (const DriftHarmonic& member : members) {
      const Vector3d gradient = member.amplitude_rad_s * y(member.degree, member.order).gradient;
      expected += member.potential == Potential::kW ? Vector3d(-gradient) : Vector3d(h.cross(gradient));
    }
    EXPECT_LT((field.rate(h) - expected).norm(), 1e-12);  // rounding of 200 gradients of up to 20 each
  }
}

TEST(Harmonics, RefuseWhatDoesNotExist) {
  EXPECT_THROW(HarmonicField({{Potential::kW, 2, 3, 1e-7}}), std::invalid_argument);
  EXPECT_THROW(HarmonicField({{Potential::kD, 0, 0, 1e-7}}), std::invalid_argument);
  EXPECT_THROW(HarmonicField({{Potential::kD, 21, 0, 1e-7}}), std::invalid_argument);
}

// The structure of eq. (1): docs/mathematics.md, section 3.

Vector3d eq1(const Vector3d& h, const Esg7::Coefficients<double>& kappa) { return Esg7::rate<double>(h, kappa); }

TEST(DriftIdentities, K0IsConservativeWithTheQuarticPotential) {
  Esg7::Coefficients<double> kappa = Esg7::Coefficients<double>::Zero();
  kappa(Esg7::kK0) = 1;
  for (const Vector3d& h : directions()) {
    const Vector3d gradient = h.array().cube();
    EXPECT_LT((eq1(h, kappa) + across(h, gradient)).norm(), 1e-15);
  }
}

TEST(DriftIdentities, MuIsConservativeWithAQuadraticPotentialButForItsCommonMode) {
  const Vector3d a(0.3, -0.5, 1.1);
  for (const Vector3d& h : directions()) {
    Esg7::Coefficients<double> kappa = Esg7::Coefficients<double>::Zero();
    kappa.segment<3>(Esg7::kMu12) << a(1) - a(0), a(2) - a(1), a(0) - a(2);
    EXPECT_LT((eq1(h, kappa) + across(h, a.cwiseProduct(h))).norm(), 1e-15);

    kappa.segment<3>(Esg7::kMu12).setOnes();
    const Vector3d gradient(h.y() * h.z(), h.z() * h.x(), h.x() * h.y());
    EXPECT_LT((eq1(h, kappa) - h.cross(gradient)).norm(), 1e-15);
  }
}

TEST(DriftIdentities, NuIsDissipativeWithAQuadraticPotentialButForItsCommonMode) {
  const Vector3d a(0.3, -0.5, 1.1);
  for (const Vector3d& h : directions()) {
    Esg7::Coefficients<double> kappa = Esg7::Coefficients<double>::Zero();
    kappa.segment<3>(Esg7::kNu12) << a(1) - a(0), a(2) - a(1), a(0) - a(2);
    EXPECT_LT((eq1(h, kappa) - h.cross(a.cwiseProduct(h))).norm(), 1e-15);

    kappa.segment<3>(Esg7::kNu12).setOnes();
    const Vector3d gradient(h.y() * h.z(), h.z() * h.x(), h.x() * h.y());
    EXPECT_LT((eq1(h, kappa) - gradient).norm(), 1e-15);
  }
}

TEST(DriftIdentities, OnlyNuHasAPartAlongTheMomentum) {
  Esg7::Coefficients<double> kappa;
  kappa << 0.7, 0.2, -0.4, 0.9, 0.3, 0.8, -0.5;
  for (const Vector3d& h : directions()) {
    EXPECT_NEAR(h.dot(eq1(h, kappa)), h.prod() * (0.3 + 0.8 - 0.5), 1e-15);
  }
}

TEST(DriftIdentities, Eq1IsSevenMembersOfTheFamilyUpToDegree4AndNoneOfThoseOutside) {
  std::vector<DriftHarmonic> family;
  for (const Potential potential : {Potential::kW, Potential::kD}) {
    for (int l = 1; l <= 4; ++l) {
      for (int m = -l; m <= l; ++m) {
        family.push_back({potential, l, m, 1});
      }
    }
  }
  const std::vector<Vector3d> points = directions(60);
  const auto rows = static_cast<Eigen::Index>(3 * points.size());
  Eigen::MatrixXd members(rows, static_cast<Eigen::Index>(family.size()));
  Eigen::MatrixXd eq1_across(rows, Esg7::kSize);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    const Esg7::Basis<double> basis = Esg7::basis<double>(points[i]);
    eq1_across.middleRows<3>(row) = basis - points[i] * (points[i].transpose() * basis);
    for (std::size_t j = 0; j < family.size(); ++j) {
      members.block<3, 1>(row, static_cast<Eigen::Index>(j)) = HarmonicField({family[j]}).rate(points[i]);
    }
  }
  const Eigen::MatrixXd amplitudes = members.colPivHouseholderQr().solve(eq1_across);
  EXPECT_LT((members * amplitudes - eq1_across).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_EQ(amplitudes.colPivHouseholderQr().rank(), Esg7::kSize);

  int outside = 0;
  for (const DriftHarmonic& member : members_outside_eq1()) {
    for (std::size_t j = 0; j < family.size(); ++j) {
      if (name(family[j]) == name(member)) {
        ++outside;
        EXPECT_LT(amplitudes.row(static_cast<Eigen::Index>(j)).cwiseAbs().maxCoeff(), 1e-13) << name(member);
      }
    }
  }
  EXPECT_EQ(outside, 12);
}

}  // namespace
}  // namespace trihedron::sim
