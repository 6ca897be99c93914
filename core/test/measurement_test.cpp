#include "trihedron/core/measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "flight.hpp"
#include "numerical_jacobian.hpp"

namespace trihedron {
namespace {

using FullGyros = test::FullEstimator::Gyros;
constexpr int kMaxStates = test::FullEstimator::kMaxStates;

/// FullGyros of any layout, a fix that agrees with them, and a fix's error by the shared states.
struct Scene {
  Layout layout;
  FullGyros gyros;
  Directions h_b;
  Eigen::Matrix3d C_in_c = test::turn(0.3, -0.2, 0.9);
  FixBySharedStates by_shared;

  explicit Scene(const Layout& its) : layout(its) {
    const Eigen::Vector3d momenta[] = {{0.51, 0.59, 0.63}, {-0.72, 0.49, 0.49}, {0.1, -0.8, 0.6}, {0.7, 0.1, -0.7}};
    for (int k = 0; k < layout.gyros; ++k) {
      gyros[k].h_in = momenta[k].normalized();
      gyros[k].drift_rad_s.setZero(layout.drift_columns());
      gyros[k].C_c_b = test::turn(0.1, -0.2, 0.3 * (k + 1));
      h_b[k] = gyros[k].C_c_b.transpose() * C_in_c.transpose() * gyros[k].h_in;
    }
    CalibrationSetup setup;
    setup.layout = layout;
    const StarFix fix{Time(std::chrono::seconds(700)), Eigen::Quaterniond::Identity(), layout.star_trackers - 1};
    by_shared = fix_by_shared_states(setup, fix, {1e-3, -2e-3, 5e-4});
  }
  /// FullGyros whose estimates are off: truth = estimate ⊕ x.
  [[nodiscard]] FullGyros off_by(const Eigen::VectorXd& x) const {
    FullGyros estimate = gyros;
    for (int k = 0; k < layout.gyros; ++k) {
      estimate[k].h_in = rotated<double>(gyros[k].h_in, -x.segment<3>(layout.direction(k)));
      estimate[k].C_c_b = test::turn(-x.segment<3>(layout.alignment(k))) * gyros[k].C_c_b;
      if (layout.further.readout_bias) {
        estimate[k].readout_bias = -x.segment<3>(layout.readout_bias(k));
      }
    }
    return estimate;
  }
  /// The fix with the error that the shared states give it.
  [[nodiscard]] Eigen::Matrix3d given(const Eigen::VectorXd& x) const {
    const Eigen::Vector3d error = by_shared * x.tail(layout.shared_size());
    return C_in_c * test::turn(error);
  }
  [[nodiscard]] Eigen::MatrixXd rows(const Eigen::VectorXd& x, const GyroMask& used) const {
    return rows_about_states_now<kMaxStates>(layout,
                                             compare(layout, off_by(x), given(x), C_in_c, h_b, used, by_shared));
  }
};

const Layout kComparedLayouts[] = {
    {},
    {.further = {.readout_bias = true}},
    {.gyros = 3, .drift_model = vsh(2), .further = {.clock_offset = true, .orbital_error = true}},
    {.further = {.clock_rate = true}},
    {.gyros = 4, .drift_model = kEsg20, .further = kAllFurtherStates, .star_trackers = 3},
};

TEST(Comparison, JacobianIsThatOfTheInnovation) {
  // y of a fix and readings that are true, as a function of how far the estimates are from the truth.
  for (const Layout& layout : kComparedLayouts) {
    for (const int left_out : {kNoGyro, 0, layout.gyros - 1}) {
      const Scene scene(layout);
      GyroMask used = all_gyros(layout.gyros);
      if (left_out != kNoGyro && layout.gyros > 2) {
        used[left_out] = false;
      }
      const auto y = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
        return scene.rows(x, used).col(layout.size());
      };
      const Eigen::VectorXd zero = Eigen::VectorXd::Zero(layout.size());
      // Seconds and radians alike are steps of 1e-5 here: the clock offset acts as 1e-3 of it.
      const Eigen::MatrixXd numerical = test::central_differences(y, zero, 1e-5);
      const Eigen::MatrixXd analytic = scene.rows(zero, used).leftCols(layout.size());
      ASSERT_EQ(analytic.rows(), 2 * count(used));
      test::expect_jacobian(analytic, numerical, 1e-8);
      if (layout.further.clock_offset) {
        const int column = layout.clock_offset();
        test::expect_jacobian(analytic.col(column).eval(), numerical.col(column).eval(), 1e-6);
      }
      EXPECT_LT(y(zero).norm(), 1e-15);
    }
  }
}

/// As of a third gyro that was started along the axis of the first, in a plan without noise.
TEST(Comparison, HasTwoComponentsOfAMomentumOnOneLineWithAnother) {
  const Layout layout{.gyros = 3};
  Scene scene(layout);
  scene.gyros[2] = scene.gyros[0];
  const FixComparison comparison =
      compare(layout, scene.gyros, scene.C_in_c, scene.C_in_c, scene.h_b, all_gyros(3), scene.by_shared);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix<double, 2, 3>& by_phi = comparison.gyros[k].by_phi;
    EXPECT_LT((by_phi * by_phi.transpose() - Eigen::Matrix2d::Identity()).norm(), 1e-15) << k;
    EXPECT_LT((by_phi * scene.gyros[k].h_in).norm(), 1e-15) << k;
  }
}

TEST(Comparison, NoiseIsThatOfFixAndReadouts) {
  const Layout layout{.gyros = 3};
  const Scene scene(layout);
  Eigen::Matrix3d R_c;
  R_c << 4, 1, 0, 1, 9, 2, 0, 2, 25;
  PerGyro<double> sigma;
  sigma[0] = 1.5;
  sigma[1] = 0.5;
  sigma[2] = 2.5;
  for (const GyroMask& used : {all_gyros(3), all_gyros(2)}) {
    // Causes: the fix's error, then the readouts.
    const auto y = [&](const Eigen::VectorXd& cause) -> Eigen::VectorXd {
      Directions h_b = scene.h_b;
      for (int k = 0; k < 3; ++k) {
        h_b[k] += cause.segment<3>(3 + 3 * k);
      }
      const Eigen::Matrix3d given = scene.C_in_c * test::turn(Eigen::Vector3d(cause.head<3>()));
      const FixComparison comparison = compare(layout, scene.gyros, given, scene.C_in_c, h_b, used, scene.by_shared);
      return rows_about_states_now<kMaxStates>(layout, comparison).col(layout.size());
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(12);
    const Eigen::MatrixXd by_cause = test::central_differences(y, zero, 1e-5);
    Eigen::MatrixXd causes = Eigen::MatrixXd::Zero(12, 12);
    causes.topLeftCorner<3, 3>() = R_c;
    for (int k = 0; k < 3; ++k) {
      causes.diagonal().segment<3>(3 + 3 * k).setConstant(sigma[k] * sigma[k]);
    }
    const Eigen::MatrixXd expected = by_cause * causes * by_cause.transpose();
    const FixComparison comparison =
        compare(layout, scene.gyros, scene.C_in_c, scene.C_in_c, scene.h_b, used, scene.by_shared);
    const ComponentCovariance R = noise_of(comparison, R_c, sigma);
    test::expect_jacobian(R, expected, 1e-6);
    // Whitened, the rows have unit noise: L Lᵀ = R, and L times them is what they were.
    const auto rows = rows_about_states_now<kMaxStates>(layout, comparison);
    auto white = rows;
    ComponentCovariance L = R;
    whiten(L, rows_of(white));
    EXPECT_LT((L * L.transpose() - R).norm(), 1e-14 * R.norm());
    EXPECT_LT((L * white - rows).norm(), 1e-14 * rows.norm());
  }
}

TEST(FixNoise, IsAboutTheAxesOfItsStarTracker) {
  CalibrationSetup setup;
  setup.layout.star_trackers = 2;
  setup.star_trackers[1].noise_rad = {1e-5, 2e-5, 3e-5};
  setup.star_trackers[1].C_c_s = test::turn(0.4, -0.7, 1.1);
  const Eigen::Matrix3d in_s =
      setup.star_trackers[1].C_c_s.transpose() * fix_noise(setup, {.head = 1}) * setup.star_trackers[1].C_c_s;
  const Eigen::Matrix3d expected = Eigen::Vector3d(1e-10, 4e-10, 9e-10).asDiagonal();
  EXPECT_LT((in_s - expected).norm(), 1e-24);
  EXPECT_LT((fix_noise(setup, {}) - 1e-8 * Eigen::Matrix3d::Identity()).norm(), 1e-22);
}

TEST(FixNoise, IsThatOfTheFixWhereItComesWithOne) {
  CalibrationSetup setup;
  setup.star_trackers[0].noise_rad = {1, 1, 1};
  const StarFix fix{.covariance = {{4e-10, 9e-10, 1e-10, 1e-10, -5e-11, 2e-11}}};
  Eigen::Matrix3d expected;
  expected << 4e-10, 1e-10, -5e-11, 1e-10, 9e-10, 2e-11, -5e-11, 2e-11, 1e-10;
  EXPECT_EQ(fix_noise(setup, fix), expected);
  setup.over_told_covariance = {2, 1, 3};  // found to scatter so much more
  EXPECT_EQ(fix_noise(setup, fix)(0, 0), 4 * 4e-10);
  EXPECT_EQ(fix_noise(setup, fix)(0, 2), 6 * -5e-11);
  EXPECT_EQ(fix_noise(setup, fix)(2, 1), 3 * 2e-11);
  EXPECT_EQ(fix_noise(setup, {.head = 1, .covariance = fix.covariance}), expected);  // found of the first alone
}

TEST(FixBySharedStates, IsHowTheFixFollowsThem) {
  CalibrationSetup setup;
  setup.layout = {.further = {.clock_offset = true, .orbital_error = true, .clock_rate = true}, .star_trackers = 3};
  setup.orbital_phase_zero = Time(std::chrono::seconds(30));
  const Layout& layout = setup.layout;
  const Eigen::Vector3d rate_c(1e-3, -2e-3, 5e-4);
  const auto by = [&](double t_s, int head) {
    return fix_by_shared_states(setup, {Time(from_seconds(t_s)), Eigen::Quaterniond::Identity(), head}, rate_c);
  };
  for (int head = 0; head < 3; ++head) {
    for (const double t_s : {30.0, 1234.5}) {
      const Eigen::MatrixXd columns = by(t_s, head);
      ASSERT_EQ(columns.cols(), layout.shared_size());
      EXPECT_EQ(columns.col(0), rate_c);
      EXPECT_LT((columns.col(1) - (t_s - 30) * rate_c).norm(), 1e-15);
      const double phase = setup.orbital_rate_rad_s * (t_s - 30);
      for (int other = 0; other < 3; ++other) {
        const double seen = other == head ? 1 : 0;
        const int first = layout.orbital_error(other) - layout.shared();
        EXPECT_LT((columns.middleCols<3>(first) - seen * std::sin(phase) * Eigen::Matrix3d::Identity()).norm(), 1e-15);
        EXPECT_LT((columns.middleCols<3>(first + 3) - seen * std::cos(phase) * Eigen::Matrix3d::Identity()).norm(),
                  1e-15);
      }
      for (int other = 1; other < 3; ++other) {
        EXPECT_EQ((columns.middleCols<3>(layout.star_tracker(other) - layout.shared())),
                  Eigen::Matrix3d(Eigen::Matrix3d::Identity() * (other == head)));
      }
    }
  }
}

TEST(Corrected, TakesTheKnownErrorOutOfTheFix) {
  const Scene scene({.further = kAllFurtherStates, .star_trackers = 2});
  const SharedStates shared = SharedStates::LinSpaced(scene.layout.shared_size(), 1e-3, 2e-3);
  const Eigen::Vector3d error = scene.by_shared * shared;
  const StarFix fix{Time{}, Eigen::Quaterniond(scene.C_in_c * test::turn(error))};
  EXPECT_LT((corrected(fix, scene.by_shared * shared).raw() - scene.C_in_c).norm(), 1e-15);
}

TEST(AttitudeByStatesNow, IsHowTheAttitudeFollowsTheErrors) {
  for (const Layout& layout : kComparedLayouts) {
    const Scene scene(layout);
    const GyroMask used = all_gyros(layout.gyros);
    const auto solution = [&](const Eigen::VectorXd& x) {
      const FullGyros gyros = scene.off_by(x);
      return optimal_attitude(momenta(gyros, layout.gyros), in_c(gyros, layout.gyros, scene.h_b), used).value();
    };
    // ε: true C_in_c = estimate · exp([ε×]); the truth is the estimate at x = 0.
    const auto error = [&](const Eigen::VectorXd& x) {
      return test::rotation_vector(solution(x).C_in_c.raw().transpose() * scene.C_in_c);
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(layout.size());
    const Eigen::MatrixXd analytic = attitude_by_states_now<kMaxStates>(layout, solution(zero), scene.gyros, scene.h_b);
    test::expect_jacobian(analytic, test::central_differences(error, zero, 1e-5), 1e-8);
  }
}

TEST(CarryBack, IsTheChainWithTheSensitivities) {
  const Layout layout{.gyros = 3, .drift_model = vsh(1), .further = kAllFurtherStates, .star_trackers = 2};
  int next = 0;
  const auto some = [&] { return std::cos(0.7 * next++); };
  test::FullEstimator::Sensitivities since;
  // The states now by the states at the beginning: φ = by_start φ0 + by_drift Δκ + by_alignment δ, the others as they
  // are.
  Eigen::MatrixXd now = Eigen::MatrixXd::Identity(layout.size(), layout.size());
  for (int k = 0; k < layout.gyros; ++k) {
    auto by_drift = since[k].by_drift.first(layout.drift_columns());
    since[k].by_start = Eigen::Matrix3d::NullaryExpr(some);
    since[k].by_alignment = Eigen::Matrix3d::NullaryExpr(some);
    by_drift = Eigen::MatrixXd::NullaryExpr(3, layout.drift_columns(), some);
    auto phi = now.middleRows<3>(layout.direction(k));
    phi.middleCols<3>(layout.direction(k)) = since[k].by_start;
    phi.middleCols<3>(layout.alignment(k)) = since[k].by_alignment;
    phi.middleCols(layout.drift(k), layout.drift_size()) = by_drift.leftCols(layout.drift_size());
    phi.middleCols<3>(layout.wandering(k)) = by_drift.middleCols<3>(layout.wandering_column());
    phi.middleCols<7>(layout.change(k)) = by_drift.middleCols<7>(layout.change_column());
    phi.middleCols<6>(layout.orbital_drift(k)) = by_drift.middleCols<6>(layout.orbital_column());
    phi.middleCols<14>(layout.polhode(k)) = by_drift.middleCols<14>(layout.polhode_column());
  }
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 4, kMaxStates> rows(4, layout.size());
  rows = Eigen::MatrixXd::NullaryExpr(4, layout.size(), some);
  for (int k = 0; k < layout.gyros; ++k) {  // what moves is looked at through the momenta alone
    rows.middleCols(layout.drift(k), layout.drift_size()).setZero();
    rows.middleCols<3>(layout.wandering(k)).setZero();
    rows.middleCols<7>(layout.change(k)).setZero();
    rows.middleCols<6>(layout.orbital_drift(k)).setZero();
    rows.middleCols<14>(layout.polhode(k)).setZero();
  }
  const Eigen::MatrixXd chain = rows * now;
  carry_back(layout, since, rows);
  EXPECT_LT((rows - chain).norm(), 1e-14 * chain.norm());
}

TEST(WithCovariance, AddsReadoutNoiseAndWalk) {
  const Scene scene({.gyros = 3});
  const auto attitude =
      optimal_attitude(momenta(scene.gyros, 3), in_c(scene.gyros, 3, scene.h_b), all_gyros(3)).value();
  PerGyro<double> noise;
  noise[0] = 1;
  noise[1] = 2;
  noise[2] = 3;
  const Eigen::Matrix3d spread = Eigen::Vector3d(1, 4, 9).asDiagonal();
  Eigen::Matrix3d expected = spread;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3d by = attitude.by_direction(k);
    expected += (noise[k] * noise[k] + 0.25) * by * by.transpose();
  }
  const AttitudeSolution solution = with_covariance(attitude, spread, noise, 3, 0.25);
  EXPECT_LT((solution.covariance_rad2 - expected).norm(), 1e-14);
  EXPECT_EQ(solution.C_in_c.raw(), attitude.C_in_c.raw());
}

}  // namespace
}  // namespace trihedron
