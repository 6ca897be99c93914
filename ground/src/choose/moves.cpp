#include "choose/moves.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "choose/jumps.hpp"
#include "choose/pass_form.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// What may be expected of each, 1-sigma: a case or a head that slips, a good one that creeps or goes to and fro,
// coefficients that change by a tenth of what is expected of them, scales as of a first ground calibration, or of
// better ones, errors of readings by direction.
constexpr double kSlips_rad = 60 * kArcsecond;
constexpr double kCreeps_rad = 5 * kArcsecond;
constexpr double kPartOfCoefficients = 0.1;
constexpr double kScales[] = {1e-3, 1e-4, 2e-5, 5e-6};
constexpr double kFields_rad[] = {5 * kArcsecond, kArcsecond};
constexpr double kPartsOfWalk[] = {0.01, 0.03, 0.1, 0.3, 1.0};
constexpr double kPolhodeOverChange = 3;  // its states have a prior of 0.3 of that of the coefficients

constexpr double kTimesOfDecay[] = {0.05, 0.1, 0.2, 0.4};  // of the pass

/// All gyros, or the star tracker against them.
constexpr int kAll = -1;

/// How far coefficients of eq. (1) may change, gyro by gyro, rad/s.
VectorXd sigmas_of_coefficients(const PassSetup& setup) {
  const Layout members = setup.layout();
  VectorXd sigmas(Index{Layout::kEq1} * members.gyros);
  for (int k = 0; k < members.gyros; ++k) {
    const Index first = members.drift(k) - members.drift(0);
    sigmas.segment<Layout::kEq1>(Index{Layout::kEq1} * k) =
        kPartOfCoefficients * setup.prior.covariance.diagonal().segment<Layout::kEq1>(first).cwiseSqrt();
  }
  return sigmas;
}

/// Tries what may move, one after another, and keeps each kind at its likeliest.
class ChangeSearch {
 public:
  /// Refers to all of them.
  ChangeSearch(const PassProblem& problem, const BatchResult& found, const PassForm& pass)
      : problem_(problem),
        found_(found),
        pass_(pass),
        gyros_(problem.layout().gyros),
        coefficient_sigma_(sigmas_of_coefficients(problem.setup())) {}

  [[nodiscard]] const VectorXd& coefficient_sigma() const { return coefficient_sigma_; }

  /// The mounting of one gyro, or of the star tracker, that slips or creeps slowly or settles.
  void try_mounting(int gyro) {
    for (const double rad : {kSlips_rad, kCreeps_rad}) {
      consider(change(mounting_of(gyro), Motion::kRamp, gyro), alignments_along(gyro, evenly()), sigmas(3, rad));
      for (const double time : kTimesOfDecay) {
        consider(decay(mounting_of(gyro), gyro, time), alignments_along(gyro, decaying(time)), sigmas(3, rad));
      }
    }
  }

  /// Coefficients that change slowly, settle, or come and go with the orbit.
  void try_coefficients(int gyro) {
    const VectorXd sigma = coefficients_of(gyro);
    consider(change(Moving::kCoefficients, Motion::kRamp, gyro), coefficients_along(gyro, evenly()), sigma);
    for (const double time : kTimesOfDecay) {
      consider(decay(Moving::kCoefficients, gyro, time), coefficients_along(gyro, decaying(time)), sigma);
    }
    Entries to_and_fro = coefficients_along(gyro, at_orbital_rate(0));
    for (const auto& sine : coefficients_along(gyro, at_orbital_rate(std::numbers::pi / 2))) {
      to_and_fro.emplace_back(sine.row(), sine.col() + sigma.size(), sine.value());
    }
    consider(change(Moving::kCoefficients, Motion::kOrbital, gyro), to_and_fro, sigma.replicate(2, 1));
  }

  /// Mountings, coefficients, and the momentum, or the inertial axes, that jump between two stretches.
  void try_steps(int gyro) {
    for (Index at = 0; at < pass_.steps(); ++at) {
      const Jump jump{pass_.middle(at), pass_.middle(at + 1)};
      const VectorXd there = once_at(at);
      for (const double rad : {kSlips_rad, kCreeps_rad}) {
        consider(step(mounting_of(gyro), gyro, jump), alignments_along(gyro, there), sigmas(3, rad));
      }
      consider(step(Moving::kCoefficients, gyro, jump), coefficients_along(gyro, there), coefficients_of(gyro));
      const Entries entries = gyro == kAll ? turn_of_axes(at) : columns_from(pass_.momentum(at, gyro), 2);
      consider(step(momentum_of(gyro), gyro, jump), entries, sigmas(gyro == kAll ? 3 : 2, kSlips_rad));
    }
  }

  /// The same that jump between two fixes. `among`: places where it might be.
  void try_jump(int gyro, const Jump& jump, std::size_t j, std::size_t among) {
    MatrixXd after = MatrixXd::Zero(kParametersOfGyro * gyros_, 3);
    for (int k = first_of(gyro); k < end_of(gyro); ++k) {
      after.middleRows<3>(kParametersOfGyro * k + Layout::kEq1).setIdentity();
    }
    const ColumnsOfJump columns = pass_.columns_of_jump();
    const Index of_case = pass_.jump(j, gyro == kAll ? ColumnsOfJump::kAllCases : ColumnsOfJump::case_of(gyro));
    for (const double rad : {kSlips_rad, kCreeps_rad}) {
      consider(step(mounting_of(gyro), gyro, jump), columns_from(of_case, 3), sigmas(3, rad), among, &after);
    }
    const Index of_momentum = pass_.jump(j, gyro == kAll ? columns.axes() : columns.momentum(gyro));
    const Index size = gyro == kAll ? 3 : 2;
    consider(step(momentum_of(gyro), gyro, jump), columns_from(of_momentum, size), sigmas(size, kSlips_rad), among);
  }

  /// Errors of fixes and readings that are there all along.
  void try_errors() {
    constexpr int kOfAberration = ErrorColumns::kOfAberration;
    constexpr int kOfReadout = ErrorColumns::kOfReadout;
    consider(present(Moving::kAberration, kAll), columns_from(pass_.error(ErrorColumns::kAberration), kOfAberration),
             sigmas_of_aberration());
    for (int i = 0; i < ErrorColumns::kMultiplesOfRate; ++i) {
      consider(change(Moving::kStarTracker, Motion::kFaster, kAll),
               columns_from(pass_.error(ErrorColumns::multiple(i)), kOfSineAndCosine),
               sigmas(kOfSineAndCosine, kCreeps_rad));
    }
    for (int k = 0; k < gyros_; ++k) {
      for (const double scale : kScales) {
        consider(present(Moving::kReadoutScale, k), columns_from(pass_.error(ErrorColumns::readout(k)), kOfReadout),
                 sigmas(kOfReadout, scale));
      }
      consider(change(Moving::kGyroCase, Motion::kOrbital, k),
               columns_from(pass_.error(ErrorColumns::case_of(k)), kOfSineAndCosine),
               sigmas(kOfSineAndCosine, kCreeps_rad));
    }
    try_fields_of_readings();
  }

  /// Coefficients that wander.
  void try_walks() {
    const Index size = coefficient_sigma_.size();
    for (const double part : kPartsOfWalk) {
      Entries entries;
      for (Index step = 0; step < pass_.steps(); ++step) {
        for (Index i = 0; i < size; ++i) {
          const auto member = static_cast<int>(i);
          entries.emplace_back(pass_.parameter(step, member / Layout::kEq1, member % Layout::kEq1), step * size + i, 1);
        }
      }
      const VectorXd of_step = part * coefficient_sigma_ / std::sqrt(static_cast<double>(pass_.steps()));
      consider(change(Moving::kCoefficients, Motion::kWalk, kAll), entries, of_step.replicate(pass_.steps(), 1));
    }
  }

  /// What was tried, the likeliest first.
  [[nodiscard]] std::vector<Change> likeliest() && {
    for (Change& change : best_) {
      change.log_odds -= std::log(tries_);
      if (change.moving == Moving::kStarTracker) {  // found as that of the cases against it
        change.size = -change.size;
      } else if (change.motion == Motion::kWalk) {
        change.size = VectorXd::Constant(1, change.size.norm());
        change.sigma = VectorXd::Constant(1, change.sigma.norm());
      } else if (change.moving == Moving::kReadoutField) {
        change.size = VectorXd::Constant(1, rms_of_field(change.size));
        change.sigma = VectorXd::Constant(1, rms_of_field(change.sigma));
      }
    }
    std::ranges::sort(best_, [](const Change& a, const Change& b) { return a.log_odds > b.log_odds; });
    return std::move(best_);
  }

 private:
  using Entries = std::vector<Eigen::Triplet<double>>;

  void consider(Change change, const Entries& entries, const VectorXd& sigma, std::size_t among = 1,
                const MatrixXd* after = nullptr) {
    check_stop();
    ++tries_;
    Eigen::SparseMatrix<double> columns(pass_.size(), sigma.size());
    columns.setFromTriplets(entries.begin(), entries.end());
    const auto same = std::ranges::find_if(best_, [&](const Change& other) {
      return other.moving == change.moving && other.motion == change.motion && other.gyro == change.gyro;
    });
    const bool is_first = same == best_.end();
    const double worth_more_than = is_first ? -std::numeric_limits<double>::infinity() : same->log_odds;
    const double places = std::log(static_cast<double>(among));
    pass_.put_into(change, columns, sigma, worth_more_than + places, after);
    change.log_odds -= places;
    if (is_first) {
      best_.push_back(std::move(change));
    } else if (change.log_odds > same->log_odds) {
      *same = std::move(change);
    }
  }

  void try_fields_of_readings() {
    constexpr int kMembers = ErrorColumns::kFields.size();
    for (const double rad : kFields_rad) {
      const VectorXd sigma = rad / std::sqrt(static_cast<double>(kMembers)) * member_rms_.cwiseInverse();
      Entries of_all;
      for (int k = 0; k < gyros_; ++k) {
        const Entries own = columns_from(pass_.error(ErrorColumns::fields(k)), kMembers);
        consider(present(Moving::kReadoutField, k), own, sigma);
        for (const auto& entry : own) {
          of_all.emplace_back(entry.row(), entry.col() + kMembers * k, entry.value());
        }
      }
      consider(present(Moving::kReadoutField, kAll), of_all, sigma.replicate(gyros_, 1));
    }
  }

  // What moves.

  static Change change(Moving moving, Motion motion, int gyro) {
    Change change;
    change.moving = moving;
    change.motion = motion;
    change.gyro = gyro;
    return change;
  }
  static Change present(Moving moving, int gyro) { return change(moving, Motion::kPresent, gyro); }
  static Change step(Moving moving, int gyro, const Jump& jump) {
    Change its = change(moving, Motion::kStep, gyro);
    its.from = jump.before;
    its.until = jump.after;
    return its;
  }
  [[nodiscard]] Change decay(Moving moving, int gyro, double time) const {
    Change its = change(moving, Motion::kDecay, gyro);
    its.decay = from_seconds(time * problem_.setup().on_board.change.duration_s);
    return its;
  }
  static Moving mounting_of(int gyro) { return gyro == kAll ? Moving::kStarTracker : Moving::kGyroCase; }
  static Moving momentum_of(int gyro) { return gyro == kAll ? Moving::kInertialAxes : Moving::kMomentum; }

  // How large it may be.

  static VectorXd sigmas(Index size, double sigma) { return VectorXd::Constant(size, sigma); }
  [[nodiscard]] VectorXd coefficients_of(int gyro) const {
    return coefficient_sigma_.segment(Index{Layout::kEq1} * first_of(gyro),
                                      Index{Layout::kEq1} * (end_of(gyro) - first_of(gyro)));
  }
  /// Root mean square over all directions, of gyros together as of one.
  [[nodiscard]] double rms_of_field(const VectorXd& amplitudes) const {
    const Index gyros = amplitudes.size() / member_rms_.size();
    const Eigen::ArrayXd each = member_rms_.replicate(gyros, 1).array();
    return each.isFinite().select(each * amplitudes.array(), 0.0).matrix().norm() /
           std::sqrt(static_cast<double>(gyros));
  }

  // Courses: by how much what moves rises from each stretch to the next.

  template <class At>
  [[nodiscard]] VectorXd rises(const At& at) const {
    return VectorXd::NullaryExpr(pass_.steps(), [&](Index step) { return at(step + 1) - at(step); });
  }
  [[nodiscard]] VectorXd evenly() const {
    return rises([this](Index stretch) { return pass_.part(stretch); });
  }
  [[nodiscard]] VectorXd decaying(double time) const {
    return rises([this, time](Index stretch) { return -std::exp(-pass_.part(stretch) / time); });
  }
  [[nodiscard]] VectorXd at_orbital_rate(double quarter_rad) const {
    const double rate_rad_s = problem_.setup().on_board.orbital_rate_rad_s;
    return rises([&](Index stretch) {
      return std::cos(rate_rad_s * to_seconds(pass_.middle(stretch) - pass_.middle(0)) - quarter_rad);
    });
  }
  [[nodiscard]] VectorXd once_at(Index step) const { return VectorXd::Unit(pass_.steps(), step); }

  // In which variables of the form it moves.

  [[nodiscard]] static int first_of(int gyro) { return std::max(gyro, 0); }
  [[nodiscard]] int end_of(int gyro) const { return gyro == kAll ? gyros_ : gyro + 1; }

  void add_parameter(Entries& entries, int gyro, int i, Index column, const VectorXd& course) const {
    for (Index step = 0; step < course.size(); ++step) {
      if (course(step) != 0) {
        entries.emplace_back(pass_.parameter(step, gyro, i), column, course(step));
      }
    }
  }
  /// Of all gyros alike, or of one.
  [[nodiscard]] Entries alignments_along(int gyro, const VectorXd& course) const {
    Entries entries;
    for (int k = first_of(gyro); k < end_of(gyro); ++k) {
      for (int i = 0; i < 3; ++i) {
        add_parameter(entries, k, Layout::kEq1 + i, i, course);
      }
    }
    return entries;
  }
  /// Of each gyro for itself, or of one.
  [[nodiscard]] Entries coefficients_along(int gyro, const VectorXd& course) const {
    Entries entries;
    for (int k = first_of(gyro); k < end_of(gyro); ++k) {
      for (int i = 0; i < Layout::kEq1; ++i) {
        add_parameter(entries, k, i, Layout::kEq1 * (k - first_of(gyro)) + i, course);
      }
    }
    return entries;
  }
  /// All momenta, by a rotation of the inertial axes.
  [[nodiscard]] Entries turn_of_axes(Index step) const {
    Entries entries;
    for (int k = 0; k < gyros_; ++k) {
      const Eigen::Matrix<double, 2, 3> by_turn = across(found_.before.arcs[pass_.arc(step)].h_in[k]).transpose();
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 3; ++j) {
          entries.emplace_back(pass_.momentum(step, k) + i, j, by_turn(i, j));
        }
      }
    }
    return entries;
  }
  [[nodiscard]] static Entries columns_from(Index at, Index size) {
    Entries entries;
    for (Index i = 0; i < size; ++i) {
      entries.emplace_back(at + i, i, 1);
    }
    return entries;
  }

  const PassProblem& problem_;
  const BatchResult& found_;
  const PassForm& pass_;
  int gyros_;
  VectorXd coefficient_sigma_;
  VectorXd member_rms_ = rms_of_fields();
  std::vector<Change> best_;
  int tries_ = 0;
};

}  // namespace

Moves moves_over(const Trial& trial) {
  constexpr std::size_t kEnoughStretches = 6;
  const PassProblem& problem = trial.problem();
  if (PassForm::stretches(problem.arcs()) < kEnoughStretches) {
    return {};
  }
  // In steady flight an alignment is as unknown as before, and what it makes with the drift is of second order: a fifth
  // of its sigma, enough for a decision, would look like something that moves.
  constexpr double kConverged = 0.01;
  std::optional<BatchResult> further;
  if (trial.found().step > kConverged) {
    further = most_likely(problem, trial.found().solution, kConverged);
  }
  const BatchResult& found = further ? *further : trial.found();
  const auto [jumps, among] = jumps_over(trial);
  const PassForm pass(problem, found, jumps);
  ChangeSearch search(problem, found, pass);
  const PolhodeSearch polhodes(pass, problem, kPolhodeOverChange * search.coefficient_sigma());
  Moves moves;
  side_by_side(
      [&] {
        for (int gyro = kAll; gyro < problem.layout().gyros; ++gyro) {
          search.try_mounting(gyro);
          search.try_coefficients(gyro);
          search.try_steps(gyro);
          for (std::size_t j = 0; j < jumps.size(); ++j) {
            search.try_jump(gyro, jumps[j], j, among);
          }
        }
        search.try_errors();
        search.try_walks();
      },
      [&] {
        for (int k = 0; k < problem.layout().gyros; ++k) {
          moves.polhodes[k] = polhodes.of_gyro(k);
        }
      });
  moves.changes = std::move(search).likeliest();
  return moves;
}

}  // namespace trihedron::ground
