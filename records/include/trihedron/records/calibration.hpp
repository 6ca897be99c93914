#pragma once
/// A calibration in memory: what calibration.json holds.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trihedron/core/time.hpp"

namespace trihedron {

/// One thing that a user of the result must know.
struct Finding {
  enum class Severity { kNote, kWarning, kDoNotUse };
  std::string code;      ///< stable, for programs: "nis-out-of-bounds"
  std::string text;      ///< for people: what was seen
  std::string evidence;  ///< the numbers behind it
  std::string cure;      ///< what to do about it
  Severity severity = Severity::kWarning;
};

struct Verdict {
  bool trustworthy = false;
  std::vector<Finding> findings;
};

struct GyroCalibration {
  std::string drift_model;                                  ///< "esg7"
  std::vector<std::pair<std::string, double>> drift_rad_s;  ///< by coefficient name, in the model's order
  Eigen::Vector3d alignment_rotation_vector_rad{0, 0, 0};   ///< Λ: C_c_b = exp([Λ×])
  Eigen::Vector3d momentum_in{0, 0, 0};                     ///< h_in at `t`, unit
  Eigen::Vector3d readout_bias{0, 0, 0};                    ///< of the direction cosines: h_b is read as h_b + bias
};

/// The parts of a state's name, "gyro2.align_x".
struct StateName {
  std::size_t gyro = 0;   ///< from 0
  std::string parameter;  ///< "k0", "align_x"
  bool is_alignment = false;
  Eigen::Index alignment_axis = 0;  ///< where it is an alignment

  explicit StateName(const std::string& state)
      : gyro(std::stoul(state.substr(4)) - 1),
        parameter(state.substr(state.find('.') + 1)),
        is_alignment(parameter.starts_with("align_")),
        alignment_axis(is_alignment ? parameter.back() - 'x' : 0) {}
};

/// A further state of an estimator: "clock_offset_s", "orbital_sine_x_rad" …
struct FurtherEstimate {
  std::string name;
  double value = 0;
  double sigma = 0;
};

/// The noise that a calibration went by.
struct CalibrationNoise {
  double direction_random_walk_rad_sqrt_s = 0;            ///< of each momentum across itself, per axis
  std::optional<Eigen::Vector3d> star_tracker_noise_rad;  ///< about c x, y, z, where it was found not to be as told
  double wandering_drift_rad_s = 0;                       ///< 1-sigma per case axis; 0: none
  double wandering_time_s = 0;                            ///< its correlation time
};

/// The result of a calibration: parameters of all gyros, their covariance, verdict, statistics.
struct Calibration {
  std::string estimator;
  Time epoch{};  ///< of the pass
  Time t{};      ///< for which the momenta stand
  std::vector<GyroCalibration> gyros;
  /// "gyro1.k0" … "gyro1.nu31", "gyro1.align_x" …; one per row of `covariance`.
  std::vector<std::string> states;
  /// rad/s for drift, rad for alignment: error δ with C_c_b(true) = exp([δ×]) C_c_b(est), c axes.
  Eigen::MatrixXd covariance;
  std::vector<FurtherEstimate> further;  ///< empty where none was estimated
  std::optional<CalibrationNoise> noise;
  Verdict verdict;
  std::map<std::string, double> statistics;
};

}  // namespace trihedron
