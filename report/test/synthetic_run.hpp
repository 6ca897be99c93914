#pragma once
/// A plausible calibration, catalogue and campaign made of formulas, to try the report on: what a run looks like, not
/// what an estimator does.

#include <chrono>
#include <string>
#include <vector>

#include "trihedron/records/campaign.hpp"
#include "trihedron/records/catalogue.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::report::test {

struct SyntheticOptions {
  Duration duration = std::chrono::hours(9);
  std::string spacecraft = "Resurs-DK1";
  /// A tracker outage of 42 min, outliers, broken gyro samples, a coefficient that stays unknown.
  bool troubled = false;
  Verdict verdict{true, {}};
};

struct SyntheticRun {
  Pass pass;
  Truth truth;
  CalibrationRun run;
  ground::CalibrationEvaluation evaluation;

  /// With truth and evaluation.
  [[nodiscard]] ReportInput judged() const { return {pass, run, &truth, {}, &evaluation}; }
  /// As after a real pass.
  [[nodiscard]] ReportInput alone() const { return {pass, run, nullptr, {}, nullptr}; }
};

/// The same options give the same run.
[[nodiscard]] SyntheticRun synthetic_run(const SyntheticOptions& options);

/// Two passes and their combination of each of three start-ups; the first pass is not trustworthy, and the last
/// start-up has other drift coefficients beside those of the run.
[[nodiscard]] std::vector<CatalogueEntry> synthetic_catalogue(const Calibration& like);

struct SyntheticCampaign {
  CampaignPlan plan;
  std::vector<RunRecord> records;
};

/// Of so many trustworthy runs, some of which have not settled; errors grow with the first of the three values drawn.
/// `nees`: mean, of 20 degrees of freedom.
[[nodiscard]] SyntheticCampaign synthetic_campaign(std::size_t runs, double nees);

}  // namespace trihedron::report::test
