#pragma once
/// Which states beyond alignment and eq. (1), and which noise, a pass gives evidence of.

#include <optional>
#include <utility>
#include <vector>

#include "batch/drift_field.hpp"
#include "batch/pass_setup.hpp"
#include "choose/forecast.hpp"
#include "choose/moves.hpp"
#include "choose/odds_of_errors.hpp"
#include "model/left_out.hpp"
#include "onboard/screen.hpp"
#include "trihedron/ground/choose/settled.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Log of the odds, 20 to 1, from which on a state or model is accepted.
inline constexpr double kLogOddsToAccept = 3;

/// Options in which nothing is left to decide (`find_noise` says whether the noise was found), and the evidence for
/// them.
struct Decision {
  CalibrationOptions options;
  double log_likelihood = 0;                ///< of the pass, with the noise that was found
  std::vector<Evidence> evidence;           ///< empty where nothing was to be decided
  std::vector<Forecast> forecasts;          ///< of the drift models that were compared
  std::optional<FieldPrior> field;          ///< where the drift is estimated as one
  std::vector<Change> changes;              ///< what moves during the pass
  PerGyro<LikelyPolhode> polhodes;          ///< with which coefficients most likely come and go, of each rotor
  std::optional<OrbitalOdds> orbital_odds;  ///< where the pass was looked at for them
  /// Where an error of the star tracker at orbital period was accepted: ln of its odds against such drift.
  std::optional<double> orbital_error_over_drift;
  /// Where drift at orbital period was found: how far that moved the alignment of each gyro, about c axes, rad.
  std::vector<Eigen::Vector3d> moved_by_orbital_drift_rad;
  /// Where a drift field was found, and eq. (1) alone would show such an error, or aberration, in its place: ln of its
  /// odds against the field.
  std::optional<double> orbital_error_over_field;
  std::optional<FieldOrError> field_or_error;  ///< where a drift field may be an error of the star tracker
  std::optional<AgainstField> against_field;   ///< where eq. (1) alone was asked for, and the noise was found
  /// Those of the pass with what it shows of the size of members outside eq. (1), for an estimator on board.
  std::optional<PassSettings> settings;
  std::optional<Calibration> members;   ///< all coefficients of the field as the trial finds them, and alignments
  std::optional<LeftOut> left_out;      ///< what an estimator on board leaves out of these
  double left_out_walk_rad_sqrt_s = 0;  ///< random walk of the momenta for that, beside the noise of the options
  std::vector<DriftFieldLevel> levels;  ///< of the field of which that estimator has the members
  std::optional<Screened> screened;     ///< the screened pass by which it was decided, where it was
  std::optional<Nearby> nearby;         ///< what was found with it
  std::optional<OnBoardRun> run;        ///< the run that screened it, where what is decided may be what it flew with

  void use(Moves moves) {
    changes = std::move(moves.changes);
    polhodes = moves.polhodes;
  }
};

/// Settles each choice that is left to the program by the whole pass. Estimator paper has no further states; where the
/// pass has a prior calibration, they are those of it; else those whose presence the pass makes 20 times as likely as
/// their absence. Unless a drift model is asked for, or the settings speak of members outside eq. (1), the drift is a
/// field: of estimator batch as it is; estimator invariant has the model of drift_on_board() with the variances that
/// were found. Where the coefficients are found to warm up, to jump or to change evenly, their change has that course,
/// and its likeliest time. The noise is found where it is asked for, on a pass that is long enough and has no prior
/// calibration. `screened_ahead`: by screened_to_decide(), where that was done before. Throws SetupError.
[[nodiscard]] Decision decide(const Pass& pass, const CalibrationOptions& asked, const Progress& progress = {},
                              std::optional<Screened> screened_ahead = {});

/// The pass as decide() screens it, where it does.
[[nodiscard]] std::optional<Screened> screened_to_decide(const Pass& pass, const CalibrationOptions& asked);

}  // namespace trihedron::ground
