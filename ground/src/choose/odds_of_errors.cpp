#include "choose/odds_of_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "choose/error_shapes.hpp"
#include "choose/stretch.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// How far drift of 1 rad/s about each axis of the body, times sine and cosine of the orbital phase, has turned a
/// momentum, in axes.
class TurnedByOrbitalDrift {
 public:
  TurnedByOrbitalDrift(double rate_rad_s, Time phase_zero) : rate_rad_s_(rate_rad_s), phase_zero_(phase_zero) {}

  /// To a later time. Between them the body turns evenly.
  void go_to(Time t, const Eigen::Quaterniond& q_in_c) {
    constexpr double kStep_s = 5;
    if (last_) {
      const double span_s = to_seconds(t - *last_);
      const auto steps = static_cast<int>(std::ceil(span_s / kStep_s));
      for (int i = 0; i < steps; ++i) {
        const double part = (i + 0.5) / steps;
        const Matrix3d by_time = span_s / steps * last_q_.slerp(part, q_in_c).toRotationMatrix();
        const double phase = rate_rad_s_ * (to_seconds(*last_ - phase_zero_) + part * span_s);
        turned_.leftCols<3>() += std::sin(phase) * by_time;
        turned_.rightCols<3>() += std::cos(phase) * by_time;
      }
    }
    last_ = t;
    last_q_ = q_in_c;
  }
  [[nodiscard]] const Eigen::Matrix<double, 3, 6>& turned_in() const { return turned_; }

 private:
  double rate_rad_s_;
  Time phase_zero_;
  std::optional<Time> last_;
  Eigen::Quaterniond last_q_ = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 3, 6> turned_ = Eigen::Matrix<double, 3, 6>::Zero();
};

/// Of shapes that are rows · beside() with the states of a trial: what the whole pass says of their sizes, all states
/// eliminated; information, and right of it its right side.
template <class Beside>
MatrixXd information_on_shapes(const Trial& trial, Index shapes, const Beside& beside) {
  const PassProblem& problem = trial.problem();
  const BatchResult& found = trial.found();
  const Index d = problem.layout().dynamic();
  const Index constants = problem.layout().size() - d;
  Stretch whole(d, constants, shapes);
  whole.measure(prior_rows(found.linear, shapes));
  const auto add = [&](std::size_t /*part*/, std::size_t arc, const MatrixXd& fixes) {
    whole.measure(fixes);
    if (arc + 1 < problem.arcs()) {
      whole.move(found.linear.stages[arc], MatrixXd(d, 0));
    }
  };
  problem.for_each_arc(found.before, {0, problem.arcs()}, beside, add);
  return without_first(without_states_at_end(whole.form(true), d), d + constants);
}

/// Of these shapes from one on, with these 1-sigmas.
LogEvidence evidence_of_shapes(const MatrixXd& information, Index at, const VectorXd& sigma) {
  const Index size = sigma.size();
  return log_evidence_of(sigma.asDiagonal() * information.block(at, at, size, size) * sigma.asDiagonal(),
                         sigma.cwiseProduct(information.col(information.cols() - 1).segment(at, size)));
}

}  // namespace

OrbitalOdds orbital_odds(const Trial& trial) {
  const PassProblem& problem = trial.problem();
  const CalibrationSetup& setup = problem.setup().on_board;
  const double rate_rad_s = setup.orbital_rate_rad_s;
  const int gyros = problem.layout().gyros;
  const Index errors = kOfSineAndCosine * problem.layout().star_trackers;
  const Index drifts = kOfSineAndCosine * gyros;
  TurnedByOrbitalDrift drift(rate_rad_s, setup.orbital_phase_zero);
  const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
    MatrixXd shapes = MatrixXd::Zero(rows.rows(), errors + drifts);
    const double phase = rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
    add_error_at(phase, rows, layout, shapes.middleCols<kOfSineAndCosine>(kOfSineAndCosine * moment.fix->fix.head));
    const Eigen::Quaterniond q_in_c = moment.fix->fix.q_in_c.normalized();
    drift.go_to(moment.t, q_in_c);
    const Eigen::Matrix<double, 3, kOfSineAndCosine> turned_c =
        q_in_c.conjugate().toRotationMatrix() * drift.turned_in();
    for (int k = 0; k < gyros; ++k) {
      const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
      shapes.middleCols<kOfSineAndCosine>(errors + kOfSineAndCosine * k) = by_alignment.lazyProduct(turned_c);
    }
    return shapes;
  };
  const MatrixXd form = information_on_shapes(trial, errors + drifts, beside);
  const double error_rad = kind_of(FurtherState::kOrbitalError).prior_sigma;
  const double drift_rad_s = std::abs(rate_rad_s) * error_rad;
  const LogEvidence error = evidence_of_shapes(form, 0, VectorXd::Constant(errors, error_rad));
  MatrixXd with_prior = form;
  with_prior.diagonal().head(errors).array() += 1 / (error_rad * error_rad);
  const LogEvidence beside_error =
      evidence_of_shapes(without_first(with_prior, errors), 0, VectorXd::Constant(drifts, drift_rad_s));
  return {error,
          evidence_of_shapes(form, errors, VectorXd::Constant(drifts, drift_rad_s)),
          {error.by_prior_as_it_is + beside_error.value, error.by_prior_as_it_is + beside_error.by_prior_as_it_is}};
}

OddsOfErrors odds_of_errors(const Trial& trial) {
  constexpr int kHarmonics = 6;
  const PassProblem& problem = trial.problem();
  const CalibrationSetup& setup = problem.setup().on_board;
  const Index of_all = kOfSineAndCosine * problem.layout().star_trackers;
  const Index harmonics = of_all * kHarmonics;
  const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
    MatrixXd errors = MatrixXd::Zero(rows.rows(), harmonics + ErrorColumns::kOfAberration);
    const double phase = setup.orbital_rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
    for (int i = 0; i < kHarmonics; ++i) {
      add_error_at((i + 1) * phase, rows, layout,
                   errors.middleCols<kOfSineAndCosine>(of_all * i + kOfSineAndCosine * moment.fix->fix.head));
    }
    if (moment.fix->fix.head == 0) {
      add_aberration(moment, phase, rows, layout, errors.rightCols<ErrorColumns::kOfAberration>());
    }
    return errors;
  };
  const MatrixXd information = information_on_shapes(trial, harmonics + ErrorColumns::kOfAberration, beside);
  const double error_rad = kind_of(FurtherState::kOrbitalError).prior_sigma;
  double with_orbit = -std::numeric_limits<double>::infinity();
  for (int count = 1; count <= kHarmonics; ++count) {
    const VectorXd sigma = VectorXd::Constant(of_all * count, error_rad);
    with_orbit = std::max(with_orbit, evidence_of_shapes(information, 0, sigma).value);
  }
  return {with_orbit - std::log(kHarmonics), evidence_of_shapes(information, harmonics, sigmas_of_aberration()).value};
}

}  // namespace trihedron::ground
