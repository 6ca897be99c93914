#pragma once
/// A small flight for the tests of core: orbital rotation with rolls and pitches, two gyros that drift by eq. (1). The
/// simulator proper is a module above core; this one only has to be independent of the code under test where it
/// matters, and exact. And what most tests do with the on-board step.

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <type_traits>
#include <vector>

#include "trihedron/core/on_board.hpp"

namespace trihedron::test {

inline constexpr double kArcsecond = std::numbers::pi / 180 / 3600;

using PairEstimator = InvariantEstimator<kPairCapacity>;
using FullEstimator = InvariantEstimator<kFullCapacity>;
using PairGyros = PairEstimator::Gyros;

struct FlightPlan {
  double duration_s = 1800;
  double slews_rad = 0.5;  ///< amplitude of rolls; a third of it in pitch
  double steady_until_s = 0;
  double turn_rad_s = 1.1e-3;  ///< of the body, in an orbit
  double misalignment = 1;     ///< times 30′
  double noise = 1;            ///< of the nominal noise
  unsigned seed = 1;
  double fix_offset_s = 0;    ///< of the first fix
  double fix_interval_s = 3;  ///< from each to the next
  double fix_jitter_s = 0;    ///< by which it may be shorter
};

struct Flight {
  static constexpr double kReadout_rad = 9.7e-6;
  static inline const Eigen::Vector3d kTracker_rad{1.45e-5, 1.45e-5, 9.7e-5};

  PairGyros truth;  ///< momenta at the end
  std::vector<GyroSample> samples;
  std::vector<StarFix> fixes;
  std::vector<Eigen::Matrix3d> C_in_c_at_samples;

  explicit Flight(const FlightPlan& plan);

  [[nodiscard]] static Eigen::Matrix3d attitude(double t_s, double slews_rad, double steady_until_s = 0,
                                                double turn_rad_s = 1.1e-3);
};

/// Samples of a pair, and a third gyro's in a case without misalignment, whose rotor does not drift from `h_in`.
[[nodiscard]] std::vector<GyroSample> with_third_gyro(const Flight& pair, const Eigen::Vector3d& h_in, unsigned seed);

/// Three independent numbers of unit variance. Drawn one after another: which of the arguments of a call is worked out
/// first is each compiler's own choice, and a test flies the same noise with all of them.
[[nodiscard]] Eigen::Vector3d white(std::mt19937& random, std::normal_distribution<double>& normal);

/// exp([v×]) for a rotation vector, rad.
[[nodiscard]] Eigen::Matrix3d turn(const Eigen::Vector3d& v);
[[nodiscard]] Eigen::Matrix3d turn(double x, double y, double z);
/// The rotation vector of a rotation, rad.
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& C);
/// Error of an attitude, c axes, rad: estimate = truth · exp([error×]).
[[nodiscard]] Eigen::Vector3d attitude_error(const Eigen::Matrix3d& truth, const AttitudeSolution& estimate);
/// (error/σ)² over all components.
[[nodiscard]] double normalised_square(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);

/// Noise and policies of the nominal mission.
[[nodiscard]] CalibrationSetup nominal_setup(const Layout& layout = {});
/// Priors of the nominal mission: 30′ of alignment, 2e-6 rad/s of each coefficient.
[[nodiscard]] Eigen::MatrixXd nominal_covariance(const Layout& layout);

/// All that an estimator is set up with: at first the nominal mission's, with means of zero.
template <class Estimator>
struct Given {
  CalibrationSetup setup;
  typename Estimator::Gyros prior;
  Eigen::MatrixXd covariance;

  explicit Given(const Layout& layout = {}) : setup(nominal_setup(layout)), covariance(nominal_covariance(layout)) {
    for (auto& gyro : prior) {
      using Drift = std::remove_cvref_t<decltype(gyro.drift_rad_s)>;
      constexpr int kRoom =
          Drift::MaxSizeAtCompileTime;  // a layout may be too large for the estimator, which refuses it
      gyro.drift_rad_s.setZero(std::min(layout.drift_columns(), kRoom));
    }
  }

  /// The same 1-sigma for each axis of all alignments.
  void set_alignment_sigma(double sigma_rad) {
    const Layout& layout = setup.layout;
    for (int k = 0; k < layout.gyros; ++k) {
      covariance.diagonal().segment<3>(layout.alignment(k) - layout.dynamic()).setConstant(sigma_rad * sigma_rad);
    }
  }
  /// Means as the truth of a flight.
  void know(const PairGyros& truth) {
    for (int k = 0; k < PairGyros::capacity(); ++k) {
      prior[k].drift_rad_s.template head<Esg7::kSize>() = truth[k].drift_rad_s;
      prior[k].C_c_b = truth[k].C_c_b;
    }
  }
  [[nodiscard]] std::optional<SetupFault> fault() const {
    return std::make_unique<Estimator>()->set_up(setup, prior, covariance);
  }
  [[nodiscard]] std::unique_ptr<Estimator> estimator() const {
    auto made = std::make_unique<Estimator>();
    TRIHEDRON_ASSERT(!made->set_up(setup, prior, covariance));
    return made;
  }
  [[nodiscard]] std::unique_ptr<OnBoard<Estimator>> on_board(const CorrectionPolicy& policy = {}) const {
    auto made = std::make_unique<OnBoard<Estimator>>();
    TRIHEDRON_ASSERT(!made->set_up(setup, prior, covariance, policy));
    return made;
  }
};

using PairGiven = Given<PairEstimator>;
using FullGiven = Given<FullEstimator>;
using PaperGiven = Given<PaperEstimator>;

/// Means that are drawn about the truth of a flight, with these 1-sigmas.
void draw_means(const PairGyros& truth, unsigned seed, double alignment_sigma_rad, PairGyros& means);

using OnReport = std::function<void(const StepReport&)>;
inline const OnReport kIgnore = [](const StepReport&) {};

/// Feeds samples and fixes to the on-board step in time order; calls on_report for every report.
template <class OnBoard>
void fly(const std::vector<GyroSample>& samples, const std::vector<StarFix>& fixes, OnBoard& on_board,
         const OnReport& on_report = kIgnore) {
  std::size_t fix = 0;
  for (const GyroSample& sample : samples) {
    for (; fix < fixes.size() && fixes[fix].t < sample.t; ++fix) {
      on_report(on_board.on_fix(fixes[fix]));
    }
    on_report(on_board.on_gyro(sample));
    for (; fix < fixes.size() && fixes[fix].t == sample.t; ++fix) {
      on_report(on_board.on_fix(fixes[fix]));
    }
  }
}
template <class OnBoard>
void fly(const Flight& flight, OnBoard& on_board, const OnReport& on_report = kIgnore) {
  fly(flight.samples, flight.fixes, on_board, on_report);
}

/// Deals with the fixes that still wait.
template <class OnBoard>
void flush(OnBoard& on_board, const OnReport& on_report = kIgnore) {
  for (StepReport report = on_board.flush(); report.fix.status != FixStatus::kNone; report = on_board.flush()) {
    on_report(report);
  }
}

/// The whole flight.
template <class Estimator>
std::unique_ptr<OnBoard<Estimator>> flown(const Flight& flight, const Given<Estimator>& given,
                                          const CorrectionPolicy& policy = {}) {
  auto on_board = given.on_board(policy);
  fly(flight, *on_board);
  flush(*on_board);
  return on_board;
}

/// Square root of the covariance of the errors at the last fix, rows as in error_layout().
template <class Estimator>
Eigen::MatrixXd error_root(const Estimator& estimator) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root(estimator.error_layout().shared(),
                                                                              estimator.states());
  estimator.error_root(rows_of(root));
  return root;
}
/// The same of all states.
template <class Estimator>
Eigen::MatrixXd state_root(const Estimator& estimator) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root(estimator.states(), estimator.states());
  estimator.errors().put_root(rows_of(root));
  return root;
}

/// vᵀ P⁻¹ v: the information about the states along v.
template <class Estimator>
double information_along(const Estimator& estimator, const Eigen::VectorXd& v) {
  return state_root(estimator).template triangularView<Eigen::Upper>().solve(v).squaredNorm();
}

/// Errors of the parameters of a pair with eq. (1), truth − estimate, in the order of the layout.
template <class Gyros>
Eigen::VectorXd parameter_errors(const PairGyros& truth, const Gyros& estimates) {
  Eigen::VectorXd errors(20);
  for (int k = 0; k < 2; ++k) {
    errors.segment<7>(10 * k) = truth[k].drift_rad_s - estimates[k].drift_rad_s.template head<Esg7::kSize>();
    errors.segment<3>(10 * k + 7) = rotation_vector(truth[k].C_c_b * estimates[k].C_c_b.transpose());
  }
  return errors;
}
/// Normalised estimation error squared of those.
template <class Estimator>
double parameter_nees(const PairGyros& truth, const Estimator& estimator) {
  const Eigen::MatrixXd root = error_root(estimator).middleRows(estimator.error_layout().drift(0), 20);
  return normalised_square(parameter_errors(truth, estimator.gyros()), root * root.transpose());
}

}  // namespace trihedron::test
