#pragma once
/// A quick fit of a pass with one choice of states, by which the choices are compared.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "batch/batch.hpp"
#include "batch/drift_field.hpp"
#include "batch/members.hpp"
#include "batch/pass_setup.hpp"
#include "choose/forecast.hpp"
#include "onboard/screen.hpp"

namespace trihedron::ground {

/// Relative difference below which two noise levels count as equal.
inline constexpr double kNoiseTolerance = 0.1;
[[nodiscard]] bool alike(const ProcessNoise& a, const ProcessNoise& b);

/// ln of the Bayes factor for a state being free instead of zero.
struct LogEvidence {
  double value = 0;              ///< of the mean of the factors by priors as wide as they are and narrower
  double by_prior_as_it_is = 0;  ///< what the likelihood of the pass gains
};

/// By what the data alone say of states in units of their prior sigmas: information · x = y (Savage and Dickey: the
/// density at zero before the data over that after). Priors are as wide as they are, a quarter, and a sixteenth of it,
/// so that small states have evidence as well.
[[nodiscard]] LogEvidence log_evidence_of(const Eigen::MatrixXd& information, const Eigen::VectorXd& y);

/// Of the difference between star tracker and gyros from one fix to the next, about c x, y, z: everything slow cancels.
struct ChangeBetweenFixes {
  Eigen::Vector3d change_rad;
  /// Of each of the two, in the mean, as the setup and the fixes say: its square is twice their sum where they are
  /// right.
  Eigen::Vector3d fix_variance_rad2;
  Eigen::Vector3d readout_variance_rad2;
};

/// The whole pass with one choice of states. Further states are judged by ln of the Bayes factor for their being free
/// instead of zero.
class Trial {
 public:
  /// `noise`: where it is other than the options say; `nearby`: another choice for the pass, where the fit begins.
  /// Refers to `screened`, which needs a fix. Throws SetupError.
  Trial(const Pass& pass, const Screened& screened, const CalibrationOptions& options,
        const std::optional<ProcessNoise>& noise = {}, const Trial* nearby = nullptr);

  /// Fits again, with other noise. The spectrum of a field is found by the last linearisation, from which the last step
  /// was a fraction of the sigmas.
  void refit(const ProcessNoise& noise);
  /// Takes noise that is other by so little that the fit is good enough.
  void set_noise(const ProcessNoise& noise) { problem_.set_noise(noise); }
  /// Where the fit of another choice of states can begin.
  [[nodiscard]] Nearby nearby() const { return {problem_.setup().on_board.layout, found_.solution}; }
  /// Frees what is large. Until it is fitted again, the trial is to be asked for nothing but nearby().
  void release() { found_.linear = {}, found_.errors = {}; }

  [[nodiscard]] const PassProblem& problem() const { return problem_; }
  [[nodiscard]] const BatchResult& found() const { return found_; }
  /// The pass by other process noise, before the spectrum of a field is found for it.
  struct ByNoise {
    double at_most = 0;  ///< ln of the likelihood; where the drift is a field, of the spectrum that would fit it wholly
    std::optional<FieldInformation> field;
  };
  /// `linear`: that of found(), also after gather_constants().
  [[nodiscard]] ByNoise by_noise(const PassProblem::Linear& linear, const ProcessNoise& noise) const;
  /// Where the drift is a field, by the spectrum of it that is most likely with that noise.
  [[nodiscard]] double log_likelihood(const ByNoise& by) const;
  /// With the noise of the fit.
  [[nodiscard]] double log_likelihood() const {
    return log_likelihood(by_noise(found_.linear, problem_.setup().noise()));
  }

  /// Prior of the drift field, where the drift is one.
  [[nodiscard]] std::optional<FieldPrior> field_prior() const;
  /// Where the drift is one: ln of the odds against no such drift of a field of the gyros, each for itself, whose
  /// members have these 1-sigmas, rad/s.
  [[nodiscard]] double log_odds_of_field(const Eigen::VectorXd& sigma_rad_s) const;
  /// All coefficients and alignments as the trial finds them, with the uncertainty that the spectrum of a field adds.
  [[nodiscard]] Calibration calibration(const FieldPrior& field) const {
    return calibration_of(problem_, kappa_and_delta(problem_, found_, field.more_covariance));
  }

  /// ln of the Bayes factor of this state, which the trial must have, where those of `zero` are zero; of no drift that
  /// wanders.
  [[nodiscard]] LogEvidence log_evidence(FurtherState state, const std::vector<FurtherState>& zero = {}) const;
  /// The largest 1-sigma of the components of this state, by the pass and its prior, where those of `zero` are zero; in
  /// the unit of the state.
  [[nodiscard]] double sigma(FurtherState state, const std::vector<FurtherState>& zero = {}) const;
  /// Forecasts by its drift model and those that it contains; none of a field.
  [[nodiscard]] std::vector<Forecast> forecasts() const;

  /// From fix to fix of the first star tracker, in the order of their times.
  [[nodiscard]] std::vector<ChangeBetweenFixes> changes() const;

 private:
  /// Estimates of the components of a further state and their covariance, in units of the 1-sigmas of their prior.
  struct InPriorSigmas {
    Eigen::VectorXd estimate;
    Eigen::MatrixXd covariance;
    Eigen::VectorXd prior_sigma;  ///< in the unit of the state
  };
  /// With these others at zero.
  [[nodiscard]] InPriorSigmas in_prior_sigmas(FurtherState state, const std::vector<FurtherState>& zero) const;
  void fit(PassSolution first, bool is_near);
  void use_modes(Eigen::VectorXd level, PassSolution& solution);
  void put_spectrum_into_prior();
  void find_field(PassSolution& first);
  [[nodiscard]] FieldInformation field_information(const PassProblem::Linear& linear, const ProcessNoise& noise) const {
    return information_on_field(problem_, found_.before, linear, noise, *field_);
  }

  DriftModelId drift_model_;
  PassProblem problem_;
  std::optional<FieldMembers> field_;  ///< where the drift is one
  FieldSpectrum spectrum_;             ///< of it
  Eigen::VectorXd field_level_;        ///< that its modes are for, ln of rad/s
  std::optional<MovedByModes> moved_;  ///< by each of its members
  BatchResult found_;
};

}  // namespace trihedron::ground
