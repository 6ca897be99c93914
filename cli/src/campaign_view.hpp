#pragma once
/// What `campaign` prints.

#include <nlohmann/json.hpp>
#include <string>

#include "trihedron/campaign/summary.hpp"
#include "trihedron/records/campaign.hpp"

namespace trihedron::cli {

/// `command`: without --only and its number, to replay a run.
[[nodiscard]] std::string campaign_text(const CampaignPlan& plan, const campaign::CampaignSummary& summary,
                                        const std::string& command);
[[nodiscard]] nlohmann::ordered_json campaign_json(const CampaignPlan& plan, const campaign::CampaignSummary& summary,
                                                   const std::string& command);

/// Of a run that was looked at alone.
[[nodiscard]] std::string run_text(const CampaignPlan& plan, const RunRecord& record);
[[nodiscard]] nlohmann::ordered_json run_json(const CampaignPlan& plan, const RunRecord& record);

}  // namespace trihedron::cli
