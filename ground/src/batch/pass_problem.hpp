#pragma once
/// A whole pass as one problem of least squares: the initial directions, the parameters, and where there is process
/// noise the directions and the wandering drift at the beginning of each arc.

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "batch/drift_modes.hpp"
#include "batch/information_smoother.hpp"
#include "batch/rotor_drift.hpp"
#include "model/gyro.hpp"
#include "onboard/screened_pass.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/setup.hpp"

namespace trihedron::ground {

/// What moves the momenta in addition to the drift model.
struct ProcessNoise {
  double direction_random_walk_rad_sqrt_s = 0;  ///< per axis across each momentum
  GaussMarkov wandering_drift;                  ///< per case axis, where the layout has it
};

struct PassSetup {
  CalibrationSetup on_board;  ///< what the estimator on board is set up with; its layout has 3 components a direction
  Prior prior;
  /// The most that a step of the prediction takes, or one sample, and half of that more before a fix; between the
  /// samples used the body turns little, and their noise is averaged in the end. While it turns by no more than
  /// `turn_in_long_step_rad`, the most is `long_step`: the midpoint rule loses a millionth of the drift.
  Duration sample_step = std::chrono::seconds(1);
  Duration long_step = std::chrono::seconds(3);
  double turn_in_long_step_rad = 0.005;
  /// Fixes closer in time than this, between which the body turns by no more than that, are merged into one; their
  /// differences are lost. Those of a degree hold 1e-5 of what the fixes tell: within it the rows change by a
  /// hundredth.
  Duration fixes_together = std::chrono::seconds(15);
  double turn_together_rad = 0.0175;
  /// Length of an arc; process noise is added at its end, and after a gap.
  Duration arc = std::chrono::seconds(60);

  /// Of each direction's error two components across the momentum, so that all of them have information; the rest as on
  /// board.
  [[nodiscard]] Layout layout() const {
    Layout layout = on_board.layout;
    layout.direction_size = 2;
    return layout;
  }
  [[nodiscard]] ProcessNoise noise() const {
    return {on_board.direction_random_walk_rad_sqrt_s, on_board.wandering_drift};
  }
};

/// Columns: two unit vectors across h and across each other; the components of the error of a direction.
[[nodiscard]] Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& h);

/// Estimates of all states; momenta and wandering drift at the beginning of each arc.
struct PassSolution {
  Gyros gyros;          ///< their momenta mean nothing
  SharedStates shared;  ///< as in the layout
  struct Arc {
    Directions h_in;
    Directions wandering_rad_s;  ///< case axes
  };
  std::vector<Arc> arcs;
};

class PassProblem {
 public:
  /// Refers to the pass, which needs a fix.
  PassProblem(const ScreenedPass& pass, PassSetup setup);

  [[nodiscard]] const PassSetup& setup() const { return setup_; }
  /// The states of the rows and solutions of the linearised problem: those of the setup, or modes in place of
  /// coefficients outside eq. (1).
  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] const std::optional<DriftModes>& modes() const { return modes_; }
  /// How far each coefficient outside eq. (1) has turned each momentum since the begin of its arc, along a solution. It
  /// depends so little on that that it need not be made again when the solution is corrected.
  [[nodiscard]] MovedByModes moved_by_coefficients(const PassSolution& solution) const;
  /// From now on modes stand for the coefficients outside eq. (1). `by_coefficients`: of moved_by_coefficients().
  void use(DriftModes modes, const MovedByModes& by_coefficients);
  /// Those of another problem of the pass with the same steps and arcs, which has them.
  void use_modes_of(const PassProblem& other);
  void set_noise(const ProcessNoise& noise) {
    setup_.on_board.direction_random_walk_rad_sqrt_s = noise.direction_random_walk_rad_sqrt_s;
    setup_.on_board.wandering_drift = noise.wandering_drift;
  }
  /// Of κ and δ; that at the construction is the setup's.
  void set_prior(Prior prior) { setup_.prior = std::move(prior); }
  [[nodiscard]] std::size_t arcs() const { return arcs_.size(); }
  [[nodiscard]] std::size_t fixes() const { return fixes_; }

  /// Momenta along the pass by these parameters, led by a fix of each arc; no wandering drift. By drift alone they
  /// would be degrees off at its end, and the linearised problem with them.
  [[nodiscard]] PassSolution start(const Gyros& gyros) const;

  /// Linearised at a solution; smooth() estimates truth − solution.
  struct Linear {
    Eigen::MatrixXd prior;
    Eigen::VectorXd prior_y;
    std::vector<SmootherStage> stages;
    /// Transition over each arc but the last, to which the process noise is added.
    struct ArcEnd {
      Eigen::MatrixXd A;  ///< without what is kept of the wandering drift
      double duration_s = 0;
      double extra_variance_rad2 = 0;  ///< for what steps too long for their readings may have missed
    };
    std::vector<ArcEnd> ends;
    /// Part of the cost that the rows do not contain: the scatter of merged fixes about their means, and for outliers 2
    /// g (1 − g/s) with s their NIS and g the gate, so that the cost of one is 2 g − g²/s (docs/mathematics.md, section
    /// 12).
    double cost_outside_rows = 0;
  };
  [[nodiscard]] Linear linearise(const PassSolution& solution) const;
  /// The same with the rows about the constants alone as a triangle in the last arc of each part of the pass: a
  /// fraction of the rows, for whom only the ends of the parts matter.
  [[nodiscard]] Linear linearise_by_parts(const PassSolution& solution) const;
  /// Makes further columns of the rows of a fix, for unknowns that are not states. Is given the moment, the layout
  /// without modes, and the rows about the states of the arc in that layout.
  struct Moment;
  using Beside = std::function<Eigen::MatrixXd(const Moment&, const Layout&, const Eigen::MatrixXd&)>;
  /// The fixes of each arc as the rows of linearise(), before these are reduced: columns about its states, those
  /// `beside`, of which there is one at least, and the misfit. An arc without a fix has no rows, of any length. Each
  /// part of the pass begins at an arc of `begins`, of which the last is behind its end; its arcs are used in turn, but
  /// the parts on all cores.
  void for_each_arc(const PassSolution& solution, const std::vector<std::size_t>& begins, const Beside& beside,
                    const std::function<void(std::size_t part, std::size_t arc, const Eigen::MatrixXd&)>& use) const;
  static constexpr std::size_t kParts = 6;
  /// The arc after the last one of that many parts.
  [[nodiscard]] std::size_t end_of(std::size_t parts) const { return parts * arcs_.size() / kParts; }
  /// Puts the prior and the process noise that the problem has now into what was linearised at this solution.
  void renew(const PassSolution& solution, Linear& linear) const;
  /// The same with other process noise than that of the setup: of the prior, and of one of the stages.
  void put_noise(const PassSolution& solution, const ProcessNoise& noise, Eigen::MatrixXd& prior,
                 Eigen::VectorXd& prior_y) const;
  void put_noise(const PassSolution& solution, const ProcessNoise& noise, std::size_t arc, const Linear::ArcEnd& end,
                 SmootherStage& stage) const;

  /// A stage of what was linearised at this solution, with this process noise.
  [[nodiscard]] SmootherStage stage(const PassSolution& solution, const Linear& linear, std::size_t arc,
                                    const ProcessNoise& noise) const;

  [[nodiscard]] Time begin_of(std::size_t arc) const { return nodes_[arcs_[arc].begin].t; }

  /// Adds the corrections that smooth() found.
  void correct(const SmootherResult& found, PassSolution& solution) const;

  /// How the momenta of a time depend on the states of its arc.
  struct ByStatesOfArc {
    /// The beginning of the arc; by the coefficients of eq. (1) alone where modes stand for the others.
    PerGyro<Sensitivity<kMaxDriftColumns>> since;
    PerGyro<Eigen::Matrix<double, 3, 2>> directions;  ///< there: φ by the two components across the momentum
  };
  struct Reading {
    Directions h_b;
    GyroMask used{};
  };
  /// The state of the solution at one time of the pass, within an arc.
  struct Moment : ByStatesOfArc {
    std::size_t arc = 0;
    Time t{};
    Reading read;
    const ScreenedPass::Fix* fix = nullptr;  ///< there, if any
    Gyros gyros;  ///< estimates, with the momenta of this time and the wandering drift of the arc
  };
  /// Visits all samples that are used, and all fixes, in time order.
  void go_along(const PassSolution& solution, const std::function<void(const Moment&)>& visit) const;
  /// The same with the momenta alone, without how they depend on the states.
  void go_along_momenta(const PassSolution& solution, const std::function<void(const Moment&)>& visit) const;
  /// What go_along() visits last.
  [[nodiscard]] Moment last_moment(const PassSolution& solution) const;

  /// A fix compared with the momenta: components of the misfit, their noise, and their derivative by the states of its
  /// arc.
  struct FixRows {
    Eigen::MatrixXd H;
    Eigen::VectorXd y;
    Eigen::MatrixXd R;        ///< with what others claim of the samples that they share
    Eigen::MatrixXd R_alone;  ///< by which it agrees or not
  };
  [[nodiscard]] FixRows compare(const PassSolution& solution, const Moment& moment) const;
  /// The same by the alignments alone: rows of unit noise, three columns of each gyro, and the misfit; none of a fix
  /// that cannot be compared or is an outlier. A moment of go_along_momenta() is enough.
  [[nodiscard]] Eigen::MatrixXd rows_about_alignments(const PassSolution& solution, const Moment& moment) const;

  /// Whether its weight is reduced because it is beyond the gate.
  [[nodiscard]] bool is_outlier(const FixRows& rows) const;

  /// By the momenta and these readings.
  [[nodiscard]] Result<AttitudeByDirections, DirectionsFault> attitude(const Moment& moment, const Directions& h_b,
                                                                       const GyroMask& used) const;
  /// Rows about the states at a moment, as on board, as rows about those of its arc.
  using Rows = ComparedRows<kPassCapacity.states>;
  [[nodiscard]] Eigen::MatrixXd by_states_of_arc(const Moment& moment, const Rows& rows) const;
  /// φ of a momentum, `in`, by the states of the arc.
  [[nodiscard]] Eigen::MatrixXd momentum_by_states(const Moment& moment, int gyro) const;
  /// Derivative of the error of an attitude, c axes, by the states of the arc.
  [[nodiscard]] Eigen::MatrixXd attitude_by_states(const Moment& moment, const AttitudeByDirections& attitude,
                                                   const Directions& h_b) const;

 private:
  /// A sample or a fix.
  struct Node {
    Time t{};
    const ScreenedPass::Fix* fix = nullptr;
    std::size_t sample = 0;  ///< where there is no fix
    bool after_gap = false;
    std::optional<std::size_t> middle = {};  ///< the sample nearest to the middle of the step that ends here
  };
  struct ArcNodes {
    std::size_t begin = 0;
    std::size_t end = 0;  ///< the first node of the next arc, which this one ends at, or that after the last
  };

  /// What turns the momenta along a solution, and the columns that the sensitivities are about: there are fewer of
  /// these where modes stand for the others.
  struct Drift {
    const DriftModel* sensitive = nullptr;
    PerGyro<RotorDrift> rotors;
  };

  /// A fix compared with the momenta at its time, not yet by the states of the arc: rows as on board, right side last.
  struct Compared {
    Rows rows;
    ComponentCovariance R;
    std::optional<ComponentCovariance> R_alone;  ///< where it is another
  };
  [[nodiscard]] Compared compare_now(const PassSolution& solution, const Moment& moment) const;
  /// Divides the rows by their noise; returns the NIS, by the noise of the fix alone.
  double whiten_rows(Compared& fix) const;
  class FixMerger;
  /// Adds the rows of a fix, whitened, with the weight that its misfit leaves it: beyond the gate, `scale` times that
  /// of its NIS, its influence falls with the third power. Returns the part of the cost that the rows do not contain.
  double add_fix(Compared fix, const Moment& moment, double scale, FixMerger& nearby) const;
  /// Those of an arc, and goes on to the beginning of the next; returns the sum of what add_fix() does.
  double add_arc(const PassSolution& solution, std::size_t arc, const Drift& drift, double scale, Moment& moment,
                 double& extra_variance_rad2, FixMerger& nearby) const;
  [[nodiscard]] Linear linearise(const PassSolution& solution, bool by_parts) const;

  [[nodiscard]] double gate_of(Eigen::Index components) const { return gates_[static_cast<std::size_t>(components)]; }
  /// How far the misfits are beyond their noise as a rule, by the first fixes of each arc: the square of it, 1 or more.
  [[nodiscard]] double scale_of_misfits(const PassSolution& solution) const;
  [[nodiscard]] Reading reading_at(const Node& node) const;
  void find_middles();
  /// The mean over a step of T seconds, of gyros that can be used at both ends. The mean of the readings at its ends
  /// alone is off by a T²/12 while the body accelerates by a; that of the parabola through them and the one in the
  /// middle is not.
  [[nodiscard]] Directions mean_reading(Time begin, const Reading& from, const Node& to_node, const Reading& to) const;
  void step(const Node& to_node, const Drift& drift, Moment& moment, double& extra_variance_rad2) const;
  /// `sensitive`: null where the momenta alone are wanted.
  [[nodiscard]] Drift drift_along(const PassSolution& solution, const DriftModel* sensitive) const;
  void go_along_arc(const PassSolution& solution, std::size_t arc, const Drift& drift,
                    const std::function<void(const Moment&)>& visit) const;
  /// Rows about the states at a moment as rows about those of its arc but for the modes, in the order of
  /// without_modes_; and these put where they are among all states.
  [[nodiscard]] Eigen::MatrixXd by_states_but_modes(const ByStatesOfArc& momenta, Rows rows) const;
  void put_beside_modes(const Eigen::MatrixXd& rows, Eigen::Ref<Eigen::MatrixXd> all) const;
  [[nodiscard]] const DriftModel& sensitive() const { return modes_ ? drift_of_eq1_ : drift_; }
  /// Coefficients outside eq. (1) as the states that stand for them, and back.
  [[nodiscard]] Eigen::VectorXd as_states(int gyro, const Eigen::VectorXd& outside) const;
  [[nodiscard]] Eigen::VectorXd as_coefficients(int gyro, const Eigen::VectorXd& states) const;
  /// Turns the momenta, by no more than that each, to where the first fix of the arc, if any, shows them.
  void follow_first_fix(const Gyros& gyros, std::size_t arc, double most_rad, Directions& h_in) const;
  void begin_arc(const PassSolution& solution, std::size_t arc, Moment& moment) const;
  /// work(first arc, the one after the last) of each part that has arcs, on all cores: it may write only what belongs
  /// to its arcs.
  void for_each_part(const std::function<void(std::size_t, std::size_t)>& work) const;
  void add_prior(const PassSolution& solution, Linear& linear) const;
  [[nodiscard]] Eigen::MatrixXd prior_covariance() const;
  void end_arc(const PassSolution& solution, const Moment& moment, double extra_variance_rad2, Linear& linear) const;

  void take(DriftModes modes);

  PassSetup setup_;
  Layout layout_;
  Layout without_modes_;  ///< the same without modes and what they stand for
  /// Of the rows of fixes and attitudes as they are on board: those of the setup, without coefficients outside eq. (1)
  /// where modes stand for them.
  Layout on_board_;
  std::optional<DriftModes> modes_;
  MovedByModes moved_by_modes_;
  DriftModel drift_;
  DriftModel drift_of_eq1_;
  int gyros_;
  std::array<double, kMaxComponents + 1> gates_{};  ///< by the number of components
  const ScreenedSamples* samples_;
  std::vector<Node> nodes_;
  std::vector<ArcNodes> arcs_;
  std::size_t fixes_ = 0;
};

}  // namespace trihedron::ground
