#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "consistency/statistics.hpp"
#include "trihedron/records/campaign.hpp"

namespace trihedron::consistency {

/// The runs at one point of the scenario's grids, of one estimator, in the order of their flights.
using Runs = std::vector<const RunRecord*>;

/// A point of the scenario's grids.
struct Cell {
  std::vector<std::string> values;  ///< slews, geometry, drift, misalignment, random walk, as the campaign has them
  std::vector<Runs> by_estimator;   ///< by Campaign::estimators; the same flights of each

  /// "slews/plane-normal/1e-06rad/s/30arcmin/0rad/s^0.5"
  [[nodiscard]] std::string name() const;
};

/// What a campaign over slews, geometry, drift, misalignment, random walk and estimators has flown.
struct Campaign {
  std::vector<std::string> estimators;
  std::vector<Cell> cells;  ///< in the order of their values
};

/// Slews, geometry, drift, misalignment, random walk, as Cell::values. Throws std::runtime_error where the campaign has
/// no grid over one of them.
[[nodiscard]] std::vector<std::string> values_of(const CampaignPlan& plan, std::span<const double> draws);

/// records: all of this plan, in the order of their numbers, which have to outlive the result. runs: of each cell and
/// estimator at most the first so many. Throws std::runtime_error for another campaign, or one that has not ended.
[[nodiscard]] Campaign campaign_of(const CampaignPlan& plan, std::span<const RunRecord> records, std::size_t runs);

/// Estimate − truth at the end of a run; not a number where it failed.
[[nodiscard]] ParameterErrors errors_of(const RunRecord& run);
/// As it claims. The run has to have it.
[[nodiscard]] ParameterCovariance covariance_of(const RunRecord& run);

/// Variances of parameter_bound() of the run's flight; not numbers with process noise.
using BoundOf = std::function<ParameterErrors(const RunRecord&)>;
/// Covariance of the parameters before the run's flight.
using PriorOf = std::function<ParameterCovariance(const RunRecord&)>;

/// Markdown: a row per cell; per estimator the means of NEES and NIS over its runs, marked where they lie outside their
/// bands, and the error over its bound.
[[nodiscard]] std::string estimators_table(const Campaign& campaign, const BoundOf& bound_of);
/// The same of the NEES of what the flights made observable: its mean, that of its degrees of freedom, its band.
[[nodiscard]] std::string observable_table(const Campaign& campaign, const PriorOf& prior_of);
/// How the first estimator differs from the second on the same flights.
[[nodiscard]] std::string agreement_table(const Campaign& campaign);

/// Puts `text` between the lines `<!-- place -->` and `<!-- end -->` of the document. Throws std::runtime_error where
/// it has none, or cannot be written.
void write_between_markers(const std::filesystem::path& document, const std::string& place, const std::string& text);

}  // namespace trihedron::consistency
