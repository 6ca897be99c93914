#pragma once
/// The report of a campaign: consistency, errors with their confidence, what matters, and the runs to look at.

#include <span>
#include <string>

#include "trihedron/campaign/summary.hpp"
#include "trihedron/records/campaign.hpp"

namespace trihedron::report {

/// Refers to its parts; they must outlive it.
struct CampaignReportInput {
  const CampaignPlan& plan;
  std::span<const RunRecord> records;        ///< in the order of their numbers
  const campaign::CampaignSummary& summary;  ///< of these
  std::string_view command;                  ///< that replays a run with --only and its number behind it
};

/// One HTML text that holds everything it shows and opens offline, UTF-8. The same input gives the same text.
[[nodiscard]] std::string render_campaign(const CampaignReportInput& input);

}  // namespace trihedron::report
