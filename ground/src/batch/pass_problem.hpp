#pragma once
/// A whole pass as one problem of least squares: the initial directions, the parameters, and where there is process
/// noise the directions and the wandering drift all along.

#include <Eigen/Core>
#include <chrono>
#include <functional>
#include <optional>
#include <vector>

#include "batch/information_smoother.hpp"
#include "model/prior.hpp"
#include "onboard/screened_pass.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron::ground {

/// Which states there are, and where they stand: those that move, then the constants per gyro, then the shared ones.
/// GyroDirections are two components across each momentum; the rest as in InvariantLayout.
struct PassLayout {
  int gyros = 2;
  int drift_size = 7;
  bool wandering_drift = false;
  bool readout_bias = false;
  bool coefficient_change = false;
  bool clock_offset = false;
  bool orbital_error = false;
  int further_heads = 0;

  [[nodiscard]] static int direction(int gyro) { return 2 * gyro; }
  [[nodiscard]] int wandering(int gyro) const { return 2 * gyros + 3 * gyro; }
  [[nodiscard]] int dynamic() const { return (wandering_drift ? 5 : 2) * gyros; }
  [[nodiscard]] int drift(int gyro) const { return dynamic() + gyro * (drift_size + 3); }
  [[nodiscard]] int alignment(int gyro) const { return drift(gyro) + drift_size; }
  [[nodiscard]] int bias(int gyro) const { return drift(gyros) + 3 * gyro; }
  [[nodiscard]] int change(int gyro) const { return bias(readout_bias ? gyros : 0) + Esg7::kSize * gyro; }
  [[nodiscard]] int shared() const { return change(coefficient_change ? gyros : 0); }
  [[nodiscard]] int clock() const { return shared(); }
  [[nodiscard]] int orbital() const { return shared() + (clock_offset ? 1 : 0); }
  /// Of head 1, 2 … beside the first, which is 0.
  [[nodiscard]] int head(int number) const { return orbital() + (orbital_error ? 6 : 0) + 3 * (number - 1); }
  [[nodiscard]] int size() const { return head(further_heads + 1); }
  [[nodiscard]] int constants() const { return size() - dynamic(); }
};

/// What moves the momenta beside the drift family.
struct ProcessNoise {
  double direction_random_walk_rad_sqrt_s = 0;  ///< per axis across each momentum
  double wandering_sigma_rad_s = 0;             ///< first-order Gauss–Markov, per case axis, where the layout has it
  double wandering_time_s = 3600;
};

struct PassSetup {
  PassLayout layout;
  DriftFamily family = DriftFamily::of<Esg7>();
  ParameterPrior prior;
  std::vector<double> readout_noise_rad;   ///< per gyro
  std::vector<Eigen::Matrix3d> fix_noise;  ///< covariance per star tracker, c axes, rad²
  double readout_bias_sigma = 1e-4;
  double coefficient_change_sigma_rad_s = 1e-7;  ///< over the pass
  double clock_offset_sigma_s = 0.1;
  double orbital_error_sigma_rad = 1e-4;
  std::vector<double> head_alignment_sigma_rad;  ///< of further heads
  double orbital_rate_rad_s = 1.1e-3;
  Time orbital_phase_zero{};
  ProcessNoise noise;
  double gate_nis = 30;  ///< of a pair; above it a fix counts less
  /// Samples are taken so far apart, or up to half as much again before a fix: the body turns little between them, and
  /// their noise is averaged in the end.
  Duration sample_step = std::chrono::seconds(1);
  /// Fixes nearer than this count as one: what they show together, without what changes among them.
  Duration fixes_together{};
  /// Process noise comes in so often, and after a gap.
  Duration arc = std::chrono::seconds(60);
};

/// Estimates of everything; momenta and wandering drift at the beginning of each arc.
struct PassSolution {
  std::vector<GyroParameters> gyros;
  Eigen::VectorXd shared;  ///< as in PassLayout, from shared() on
  struct Arc {
    GyroDirections h_in;
    GyroDirections wandering_rad_s;  ///< case axes
  };
  std::vector<Arc> arcs;
};

/// How one momentum depends on the states of its arc: φ = by_direction a + by_wandering w + by_drift κ + by_change
/// Δ + by_alignment δ.
struct MomentumBy {
  Eigen::Matrix<double, 3, 2> direction;
  Eigen::Matrix3d wandering;                     ///< s
  DriftFamily::Basis drift;                      ///< s
  Eigen::Matrix<double, 3, Esg7::kSize> change;  ///< s
  Eigen::Matrix3d alignment;
};

class PassProblem {
 public:
  /// Refers to the pass. Needs a fix.
  PassProblem(const ScreenedPass& pass, PassSetup setup);

  [[nodiscard]] const PassSetup& setup() const { return setup_; }
  void set_noise(const ProcessNoise& noise) { setup_.noise = noise; }
  [[nodiscard]] std::size_t arcs() const { return arcs_.size(); }

  /// Momenta along the pass by these parameters, those at its first fix read from it; no wandering drift.
  [[nodiscard]] PassSolution start(const std::vector<GyroParameters>& gyros) const;

  /// Linearised at a solution; smooth() estimates truth − solution.
  struct Linear {
    Eigen::MatrixXd prior;
    Eigen::VectorXd prior_y;
    std::vector<SmootherStage> stages;
    /// What the process noise is put into, arc by arc but for the last.
    struct ArcEnd {
      Eigen::MatrixXd A;  ///< without what is kept of the wandering drift
      double duration_s = 0;
      double extra_variance_rad2 = 0;  ///< for what steps too long for their readings may have missed
    };
    std::vector<ArcEnd> ends;
    /// What counts beyond the squares of the rows: the scatter of fixes that count as one, and of outliers, whose rows
    /// have less weight, so much that they are 2 g − g²/s together, s their NIS and g the gate: a worse one is not more
    /// likely.
    double beside_square = 0;
  };
  [[nodiscard]] Linear linearise(const PassSolution& solution) const;
  /// The same with other process noise than that of the setup.
  void put_noise(const PassSolution& solution, const ProcessNoise& noise, Linear& linear) const;

  [[nodiscard]] Time begin_of(std::size_t arc) const { return nodes_[arcs_[arc].begin].t; }

  /// What is known of a gyro, with its part of truth − solution added.
  [[nodiscard]] GyroParameters corrected(GyroParameters parameters, int gyro, const Eigen::VectorXd& x) const;
  /// Adds what smooth() found.
  void correct(const SmootherResult& found, PassSolution& solution) const;

  /// One time within an arc.
  struct Moment {
    std::size_t arc = 0;
    Time t{};
    const ScreenedPass::Fix* fix = nullptr;  ///< there, if any
    GyroDirections h_in;
    std::vector<MomentumBy> by;
  };
  /// Goes along all samples, thinned, and fixes, in time order.
  void go_along(const PassSolution& solution, const std::function<void(const Moment&)>& visit) const;

  /// Components that a fix is compared in: how far each momentum read through it is off, by the states of its arc.
  struct FixRows {
    Eigen::MatrixXd H;
    Eigen::VectorXd y;
    Eigen::MatrixXd R;
  };
  [[nodiscard]] FixRows compare(const PassSolution& solution, const Moment& moment) const;

  /// Whether it counts less than it would by its noise.
  [[nodiscard]] bool is_outlier(const FixRows& rows) const;

  /// By the momenta and these readings.
  [[nodiscard]] static Result<AttitudeByDirections<kMaxGyros>, DirectionsFault> attitude(const PassSolution& solution,
                                                                                         const Moment& moment,
                                                                                         const GyroDirections& h_b,
                                                                                         const GyrosUsed& used);
  /// How its error, c axes, depends on the states of the arc.
  [[nodiscard]] Eigen::MatrixXd attitude_by_states(const PassSolution& solution, const Moment& moment,
                                                   const AttitudeByDirections<kMaxGyros>& attitude,
                                                   const GyroDirections& h_b) const;

 private:
  /// Something to go along: a sample or a fix.
  struct Node {
    Time t{};
    GyroDirections h_b;
    GyrosUsed used{};
    const ScreenedPass::Fix* fix = nullptr;
    bool after_gap = false;
  };
  struct ArcNodes {
    std::size_t begin = 0;
    std::size_t end = 0;  ///< the first node of the next arc, which this one ends at, or that after the last
  };

  void step(const PassSolution& solution, const Node& from, const Node& to, Moment& moment,
            double& extra_variance_rad2) const;
  /// Of the coefficient change: −1 at the begin of the pass, 0 at its end.
  [[nodiscard]] double part_of_change(Time t) const;
  void begin_arc(const PassSolution& solution, std::size_t arc, Moment& moment) const;
  [[nodiscard]] Eigen::Matrix3Xd fix_by_shared(const ScreenedPass::Fix& fix) const;
  void add_prior(const PassSolution& solution, Linear& linear) const;
  void end_arc(const PassSolution& solution, const Moment& moment, double extra_variance_rad2, Linear& linear) const;

  PassSetup setup_;
  int gyros_;
  std::vector<Node> nodes_;
  std::vector<ArcNodes> arcs_;
};

}  // namespace trihedron::ground
