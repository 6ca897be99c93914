#pragma once
/// The drift of rotors as a random field on the sphere (docs/mathematics.md, section 12): members outside eq. (1) with
/// variances, one for each gyro, potential, degree and symmetry, that the pass determines.

#include <Eigen/Core>
#include <vector>

#include "batch/pass_problem.hpp"
#include "model/drift_on_board.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// Which states of a layout are members outside eq. (1), and which share a variance.
class FieldMembers {
 public:
  explicit FieldMembers(const Layout& layout);

  /// Of one gyro, potential and degree: those that half a turn about any axis of the case leaves as they are, as it
  /// does all of eq. (1), or the others.
  struct Group {
    int gyro = 0;
    DriftCoefficient::Member potential = DriftCoefficient::Member::kW;
    int degree = 0;
    bool symmetric = false;

    friend bool operator==(const Group&, const Group&) = default;
  };
  [[nodiscard]] const std::vector<Group>& groups() const { return groups_; }
  /// State of each member, as among all states; group of each.
  [[nodiscard]] const std::vector<Eigen::Index>& states() const { return states_; }
  [[nodiscard]] const std::vector<Eigen::Index>& group_of() const { return group_of_; }
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(states_.size()); }

  /// Those of one gyro, of which each has as many.
  [[nodiscard]] Eigen::Index of_one_gyro() const { return size() / (groups_.back().gyro + 1); }

  /// The spectrum that a rotor is expected to have, ln of the root mean square of each group, rad/s.
  [[nodiscard]] Eigen::VectorXd expected() const;
  /// 1-sigma of each member, rad/s, with which the members of each group make drift of this root mean square over the
  /// sphere, rad/s; ln of that, by group.
  [[nodiscard]] Eigen::VectorXd sigma(const Eigen::VectorXd& log_rms) const;

 private:
  std::vector<Group> groups_;
  std::vector<Eigen::Index> states_;
  std::vector<Eigen::Index> group_of_;
  Eigen::VectorXd of_rms_;  ///< 1-sigma of each member over the root mean square of its group
};

/// The combinations of the members that a pass can show where each group has drift of up to this root mean square, ln
/// of rad/s. `by_coefficients`: of a solution near enough to tell how the gyros moved.
[[nodiscard]] DriftModes modes_of(const PassProblem& problem, const MovedByModes& by_coefficients,
                                  const FieldMembers& members, const Eigen::VectorXd& log_rms);
/// The same where the prior covariance of the members of each gyro is known, of whatever form.
[[nodiscard]] DriftModes modes_of(const PassProblem& problem, const MovedByModes& by_coefficients);

/// What a pass says of the members when nothing is known of them before, all other states eliminated: R a = y + unit
/// noise, a their amplitudes, rad/s.
struct FieldInformation {
  Eigen::MatrixXd R;  ///< a row for each mode
  Eigen::VectorXd y;
  double log_likelihood = 0;  ///< of what the members have no part in, up to a constant of the pass
  /// How the estimates of the other constants, in their order, follow those of the members.
  Eigen::MatrixXd others_by_members;
};

/// The problem has modes. `linear`: the problem linearised at the solution, also after gather_constants(); `noise`: the
/// process noise.
[[nodiscard]] FieldInformation information_on_field(const PassProblem& problem, const PassSolution& solution,
                                                    const PassProblem::Linear& linear, const ProcessNoise& noise,
                                                    const FieldMembers& members);

/// The spectrum that makes the pass most likely, ln of the root mean square of each group, rad/s; its prior is in the
/// source.
struct FieldSpectrum {
  Eigen::VectorXd log_rms;
  Eigen::MatrixXd information;  ///< on log_rms, there
  double log_likelihood = 0;    ///< of the pass, with the prior density of the spectrum; up to a constant of the pass
};

/// By Newton's method. `first`: where it begins; empty: at the expected one. No group becomes larger than 1e-5 rad/s.
[[nodiscard]] FieldSpectrum most_likely_spectrum(const FieldMembers& members, const FieldInformation& information,
                                                 const Eigen::VectorXd& first = {});

/// What the uncertainty of the spectrum adds to the covariance of the amplitudes, about their estimates by the most
/// likely one. What no data determine has the mean variance over the spectra that the pass allows.
[[nodiscard]] Eigen::MatrixXd covariance_of_spectrum(const FieldMembers& members, const FieldInformation& information,
                                                     const FieldSpectrum& spectrum);

/// The prior of the drift field that a pass has determined.
struct FieldPrior {
  DriftModes modes;
  Eigen::VectorXd sigma_rad_s;      ///< of each member, in their order
  Eigen::MatrixXd more_covariance;  ///< of κ and δ, for the uncertainty of the spectrum
  std::vector<DriftFieldLevel> levels;
  double log_evidence = 0;  ///< ln of how much more likely the pass is by the spectrum than without any such drift
  /// Of each member what the pass leaves possible, the uncertainty of the spectrum included: the mean of its group.
  MeanSquares members;
};

/// As covariance_of_spectrum(), carried over to κ and δ.
[[nodiscard]] FieldPrior field_prior(const PassProblem& problem, const FieldMembers& members,
                                     const FieldInformation& information, const FieldSpectrum& spectrum);

/// Sets the variances of the members in a prior that knows nothing else of them.
void put_sigma(const Layout& layout, const FieldMembers& members, const Eigen::VectorXd& sigma_rad_s, Prior& prior);

}  // namespace trihedron::ground
