#include "trihedron/ground/calibrate/several_passes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "calibrate/calibrate_after.hpp"
#include "model/left_out.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Severity = Finding::Severity;

constexpr FindingCode kWeakAxis = FindingCode::kWeakAlignmentAxis;

bool same_mounting(const FurtherStarTracker& a, const FurtherStarTracker& b) {
  return a.mounting_rotation_vector_rad == b.mounting_rotation_vector_rad;
}

void refuse_stranger(const PassSettings& last, const PassSettings& next, const std::string& start_up) {
  constexpr const char* kApart = "calibrate it apart";
  if (next.spacecraft != last.spacecraft) {
    throw SetupError(fmt::format("the pass is of {}, the one before of {}", next.spacecraft, last.spacecraft), kApart);
  }
  if (next.epoch < last.epoch + last.duration) {
    throw SetupError("the pass begins before the one before it ends", "give passes that do not overlap, each once");
  }
  if (next.gyros.size() != last.gyros.size()) {
    throw SetupError(fmt::format("the pass has {} gyros, the one before {}", next.gyros.size(), last.gyros.size()),
                     kApart);
  }
  if (!std::ranges::equal(next.further_star_trackers, last.further_star_trackers, same_mounting)) {
    throw SetupError("the pass is of other star trackers, or of other mountings, than the one before", kApart);
  }
  if (!start_up.empty() && !next.start_up.empty() && next.start_up != start_up) {
    throw SetupError(fmt::format("the pass is of start-up '{}', the ones before of '{}'", next.start_up, start_up),
                     "calibrate each start-up apart: drift coefficients change at every start of a rotor");
  }
}

/// The most likely value by the data alone, estimate + `shift`, and its covariance, very large where the data say
/// nothing.
struct Likelihood {
  VectorXd shift;
  MatrixXd covariance;
};

Likelihood likelihood_of(const Calibration& before, const Calibration& after) {
  // Lower limit of the information that the data add, as a fraction of that of the prior.
  constexpr double kLeast = 1e-6;
  // Where P0 is one, P has eigenvalues λ of 0 to 1, and the inverse of P⁻¹ − P0⁻¹ has λ / (1 − λ).
  const Eigen::LLT<MatrixXd> prior(before.covariance);
  const MatrixXd root = prior.matrixL();
  const MatrixXd half = prior.matrixL().solve(after.covariance);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> left(prior.matrixL().solve(half.transpose()));
  const Eigen::ArrayXd part = left.eigenvalues();
  const VectorXd variance = part / (1 - part).max(kLeast);
  const MatrixXd spread = root * left.eigenvectors() * variance.asDiagonal() * left.eigenvectors().transpose();
  return {spread * prior.matrixL().solve(difference(before, after, after.states)), spread * root.transpose()};
}

struct Comparison {
  Agreement coefficients;
  Agreement alignments;
};

/// With the covariance that the data alone leave: what is added to it for coefficients that may have changed would look
/// like data that say less than nothing.
Calibration of_constants(const CalibrationRun& run) {
  Calibration calibration = run.calibration;
  calibration.covariance = run.covariance_of_constants;
  return calibration;
}

/// Its coefficients of eq. (1) and alignments alone. Of the members of a drift field the prior is found from the pass,
/// so that it cannot be taken off again.
Calibration without_members(Calibration calibration) {
  std::vector<ParameterId> states = drift_and_alignment(kEsg7, calibration.gyros.size());
  const auto rows = rows_of(calibration, states);
  calibration.covariance = calibration.covariance(rows, rows).eval();
  calibration.states = std::move(states);
  return calibration;
}

/// `before`: the calibration of the passes before; of one with more members than the later one has, what makes up for
/// these is compared.
Comparison compare(const CalibrationRun& before, const CalibrationRun& later) {
  struct {
    Calibration calibration, known_before;
  } earlier{of_constants(before), before.known_before};
  const DriftModelId& model = later.calibration.gyros.front().drift_model;
  if (model.size() < before.calibration.gyros.front().drift_model.size()) {
    earlier = {LeftOut(earlier.calibration, model).reduced(), LeftOut(earlier.known_before, model).reduced()};
  }
  const Calibration known_before = without_members(earlier.known_before);
  const Calibration first = without_members(earlier.calibration);
  const Calibration second = without_members(of_constants(later));
  const Likelihood a = likelihood_of(known_before, first);
  const Likelihood b = likelihood_of(without_members(later.known_before), second);
  const VectorXd moved = difference(first, second, second.states) + b.shift - a.shift;
  const MatrixXd covariance = a.covariance + b.covariance;
  const auto among = [&](bool alignments) {
    const auto rows = rows_of(second, common_states(second, first, alignments));
    return agreement_within(moved(rows), covariance(rows, rows), known_before.covariance(rows, rows));
  };
  return {among(false), among(true)};
}

/// Findings that forbid the use of one pass and hold for the passes together as well; a need is one of all together.
std::vector<std::string_view> lasting_faults(const Verdict& verdict) {
  std::vector<std::string_view> codes;
  for (const Finding& finding : verdict.findings) {
    if (finding.severity == Severity::kDoNotUse && finding.code != kWeakAxis &&
        finding.code != FindingCode::kNeedNotMet) {
      codes.push_back(name_of(finding.code));
    }
  }
  return codes;
}

void judge_pass(const PassAlone& pass, std::vector<Finding>& findings) {
  if (!pass.coefficients.holds()) {
    findings.push_back(
        {FindingCode::kCoefficientsMoved,
         fmt::format("The drift coefficients of {} are not those of the passes before.", pass.name),
         pass.coefficients.text(),
         "These passes are not of one start-up: calibrate them apart. Where they are, use estimator batch.",
         Severity::kDoNotUse});
  }
  if (!pass.alignments.holds()) {
    findings.push_back({FindingCode::kAlignmentMoved,
                        fmt::format("The alignments of {} are not those of the passes before.", pass.name),
                        pass.alignments.text(),
                        "Look for what turned a gyro or the star tracker between the passes; calibrate them apart.",
                        Severity::kDoNotUse});
  }
  if (const auto faults = lasting_faults(pass.run.calibration.verdict); !faults.empty()) {
    findings.push_back({FindingCode::kPassNotTrustworthy, fmt::format("{} alone is not to be used.", pass.name),
                        fmt::format("{}", fmt::join(faults, ", ")), "Leave it out, or cure what its own report tells.",
                        Severity::kDoNotUse});
  }
}

/// Whether each pass has this finding by itself.
bool each_has(const std::vector<PassAlone>& passes, FindingCode code) {
  return std::ranges::all_of(passes, [&](const PassAlone& pass) { return pass.run.calibration.verdict.has(code); });
}

/// What no pass shows by itself is not known of all together either; the last pass, which has a prior calibration, was
/// not asked for it.
void keep_what_is_not_shown(const std::vector<PassAlone>& passes, std::vector<Finding>& findings) {
  constexpr FindingCode kNotShown = FindingCode::kStarTrackerErrorsNotShown;
  if (each_has(passes, kNotShown)) {
    const PassAlone& last = passes.back();
    Finding& finding =
        findings.emplace_back(*std::ranges::find(last.run.calibration.verdict.findings, kNotShown, &Finding::code));
    finding.evidence = fmt::format("in each pass, as in {}: {}", last.name, finding.evidence);
  }
}

/// Of the last pass from those before, by what each pass is.
Verdict judge_together(const Verdict& last, const std::vector<PassAlone>& passes) {
  Verdict verdict;
  for (const PassAlone& pass : passes) {
    judge_pass(pass, verdict.findings);
  }
  verdict.findings.insert(verdict.findings.end(), last.findings.begin(), last.findings.end());
  if (!each_has(passes, kWeakAxis)) {
    std::erase_if(verdict.findings, [](const Finding& finding) { return finding.code == kWeakAxis; });
  }
  keep_what_is_not_shown(passes, verdict.findings);
  verdict.trustworthy = std::ranges::none_of(
      verdict.findings, [](const Finding& finding) { return finding.severity == Severity::kDoNotUse; });
  return verdict;
}

}  // namespace

void SeveralPasses::combine(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  Pass next = pass;
  next.settings.prior = combined_.calibration;
  CalibrationRun together = calibrate_after(next, options, progress, std::move(combined_.known_before));
  together.calibration.verdict = judge_together(together.calibration.verdict, passes_);
  combined_ = std::move(together);
}

const PassAlone& SeveralPasses::add(const std::string& name, const Pass& pass, const Progress& progress) {
  CalibrationOptions options = options_;
  if (!passes_.empty()) {
    refuse_stranger(last_, pass.settings, start_up_);
    // One start of the rotors has one drift model.
    options.drift_model = combined_.options.drift_model;
    options.drift_field = combined_.options.drift_field;
  }
  PassAlone& added = passes_.emplace_back(PassAlone{name, calibrate(pass, options, progress), {}, {}});
  if (passes_.size() == 1) {
    combined_ = added.run;
  } else {
    const Comparison found = compare(combined_, added.run);
    added.coefficients = found.coefficients;
    added.alignments = found.alignments;
    combine(pass, options, progress);
  }
  last_ = pass.settings;
  start_up_ = start_up_.empty() ? pass.settings.start_up : start_up_;
  combined_.calibration.start_up = start_up_;
  return added;
}

std::vector<CatalogueEntry> SeveralPasses::catalogue_entries() const {
  std::vector<CatalogueEntry> entries;
  for (const PassAlone& pass : passes_) {
    entries.push_back({last_.spacecraft, pass.name, start_up_, 1, pass.run.calibration});
  }
  if (passes_.size() > 1) {
    entries.push_back(
        {last_.spacecraft, passes_.back().name, start_up_, static_cast<int>(passes_.size()), combined_.calibration});
  }
  return entries;
}

}  // namespace trihedron::ground
