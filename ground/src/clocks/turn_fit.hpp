#pragma once
/// Least squares over turns of half a minute: how far the clocks of star tracker and gyros are apart, and when that
/// changes.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "clocks/turns.hpp"
#include "trihedron/records/clocks.hpp"

namespace trihedron::ground {

/// What is fitted: offset and rate of the star tracker's clock about the middle of the pass, how late each gyro is
/// there against the first and how fast that grows, and of each gyro what would pass for it: alignment and coefficients
/// of eq. (1).
struct Unknowns {
  int gyros;
  [[nodiscard]] static constexpr int offset() { return 0; }
  [[nodiscard]] static constexpr int rate() { return 1; }
  [[nodiscard]] static constexpr int late(int gyro) { return 1 + gyro; }          ///< of gyro 2 on
  [[nodiscard]] constexpr int late_rate(int gyro) const { return gyros + gyro; }  ///< likewise
  [[nodiscard]] constexpr int alignment(int gyro) const { return 2 * gyros + kOwn * gyro; }
  [[nodiscard]] constexpr int drift(int gyro) const { return alignment(gyro) + 3; }
  [[nodiscard]] constexpr int size() const { return alignment(gyros); }
  static constexpr int kOwn = 3 + Esg7::kSize;
};

/// Times by the stamps of the star tracker: fixes from `from` on, before `until`.
struct Interval {
  Time from{};
  Time until{};

  [[nodiscard]] bool has(Time t) const { return t >= from && t < until; }
};

/// A clock that is off by more or less over a part of the pass than over the rest.
struct Stepping {
  int gyro = -1;  ///< whose stamps are later there; −1: fixes were taken later after their stamps
  Interval part;
};

/// Derived in docs/mathematics.md, section 7.
class TurnFit {
  static constexpr std::size_t kThinned = 4;  ///< of the turns one in so many, at first
  static constexpr int kMostRows = 2 * kMaxGyros;
  using Rows =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMostRows, Unknowns{kMaxGyros}.size() + 2>;

 public:
  /// Of readings and fixes of `pass`, which have to outlive it; it begins at this offset.
  TurnFit(const Pass& pass, const GyroReadings& readings, double offset_s);
  /// With a step as one more unknown, which begins at `change_s`.
  TurnFit(const Pass& pass, const GyroReadings& readings, double offset_s, const Stepping& stepping, double change_s);

  /// Clocks run at the same rate.
  void hold_rates();

  /// False where the fit does not come to an end, or the pass does not show the clocks: the body turns evenly, or the
  /// telemetry is too short.
  [[nodiscard]] bool converge();
  /// After converge(), as all below.
  [[nodiscard]] Clocks clocks() const;

  /// The likeliest step that this fit does not have. Its ends are known to a stretch, a sixtieth of the pass. Nothing
  /// where no step is likely.
  [[nodiscard]] std::optional<Stepping> suspected_step() const;

  /// The size of the step.
  [[nodiscard]] Measured change() const;
  /// The part of the pass whose turns are likelier with the step than without; up to the begin and the end of the pass
  /// where no turn says otherwise.
  [[nodiscard]] Interval part_with_step();

 private:
  /// What one stretch of the pass says of the unknowns.
  struct Stretch {
    Interval interval;
    int turns = 0;
    bool is_used = false;  ///< whether any turn is
    Eigen::VectorXd score;
    Eigen::MatrixXd normal;           ///< lower triangle
    Eigen::VectorXd bounded_score;    ///< of all turns, those as well that are not used, none with more than its bound
    Eigen::MatrixXd rejected_normal;  ///< lower triangle, of those that are not used

    explicit Stretch(int n);
  };
  /// What the gyros read at a fix, and by which clock the samples around it were fitted.
  struct Fitted {
    double clock_s = 0;
    std::optional<FittedDirections> directions;
  };
  /// The readings at a fix by the clocks as they are now, with their rates; c axes by the alignments known before, and
  /// by those that are fitted.
  struct AtFix {
    bool is_there = false;
    Directions h;
    Directions aligned;  ///< and by how late each gyro is
    Directions aligned_rate;
    Eigen::Matrix3d trihedron;
    /// By each coefficient of eq. (1): how far the drift has turned each momentum since the first fix, in axes of the
    /// trihedron.
    PerGyro<Esg7::Basis<double>> turned;
  };
  /// That sum on its way along the pass.
  struct DriftSum {
    std::optional<Time> t;
    PerGyro<Esg7::Basis<double>> rate;
    PerGyro<Esg7::Basis<double>> turned;
  };

  void read(bool roughly);
  void add_drift(Time t, const Directions& h, const Eigen::Matrix3d& trihedron, DriftSum& sum) const;
  /// Goes on to a fix by the readings on the way, where it is far.
  void add_drift_until(Time t, double clock_s, const PerGyro<Eigen::Matrix3d>& align, DriftSum& sum) const;
  [[nodiscard]] bool rows_of(const Turn& turn, bool roughly, Rows& rows, double& noise_square) const;
  [[nodiscard]] bool step(bool roughly);
  [[nodiscard]] int size() const { return static_cast<int>(x_.size()); }
  [[nodiscard]] int place_of_step() const { return unknowns_.size(); }
  [[nodiscard]] bool steps(Time t) const { return stepping_ && stepping_->part.has(t); }
  [[nodiscard]] Eigen::VectorXd unit(int unknown) const { return Eigen::VectorXd::Unit(size(), unknown); }
  [[nodiscard]] Eigen::VectorXd offset_of(int gyro) const;
  [[nodiscard]] Eigen::VectorXd rate_of(int gyro) const;
  [[nodiscard]] Eigen::VectorXd by_stepping(int gyro) const;
  [[nodiscard]] long used_stretches() const;
  [[nodiscard]] Measured measured(const Eigen::VectorXd& a) const;
  /// Where the fixes of a turn are, in time: before the step, in it.
  enum Ends : std::uint8_t { kOutside, kEnters, kLeaves, kInside };
  /// Of the residuals of each turn by Ends, none more than where a turn is not used; zeros where a reading is missing.
  using Squares = std::vector<Eigen::Array4d>;
  [[nodiscard]] Squares squares_by_ends();
  [[nodiscard]] static std::pair<std::size_t, std::size_t> turns_with_step(const Squares& squares);
  /// The first fix behind the likeliest edge, by the turns from one to before another: as they lie before, across and
  /// after it. The begin or the end of the pass where it may be there.
  [[nodiscard]] std::size_t edge(const Squares& squares, std::size_t from, std::size_t until, Ends before, Ends across,
                                 Ends after) const;

  const Pass& pass_;
  const GyroReadings& readings_;
  Unknowns unknowns_;
  std::optional<Stepping> stepping_;
  double lag_s_;
  std::vector<Turn> turns_;
  Eigen::VectorXd x_;
  Eigen::VectorXd prior_sigma_;
  Time begin_{};
  Time middle_{};
  std::vector<std::optional<Fitted>> fitted_;
  std::vector<AtFix> at_fix_;
  double scale_ = 1;
  double shown_by_noise_ = 0;  ///< square sum of the derivatives by the offset that noise alone would make, 1/s²
  Eigen::LLT<Eigen::MatrixXd> normal_;
  std::vector<Stretch> stretches_;
};

}  // namespace trihedron::ground
