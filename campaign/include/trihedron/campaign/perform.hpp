#pragma once
/// The runs of a campaign. A run is a function of its number alone; who performs it, in what order and beside what does
/// not matter. Whoever collects the records is the only one that writes.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/records/campaign.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::campaign {

/// What a run flies, and how that is calibrated.
struct RunSetup {
  Scenario scenario;
  CalibrationOptions options;
};

/// That of a run by its seed and draws. Called from several threads. Throws std::invalid_argument for draws that make
/// no scenario or no settings; that run has failed. Whatever else it throws ends the campaign.
using SetupOf = std::function<RunSetup(std::uint64_t seed, std::span<const double> draws)>;

/// All of a run: for one that is looked at alone.
struct Flight {
  sim::SimulatedPass simulated;
  CalibrationRun run;
  ground::CalibrationEvaluation evaluation;
};

/// Simulates, calibrates, compares with the truth. Throws std::invalid_argument and ground::SetupError.
[[nodiscard]] Flight fly(const RunSetup& setup, double limit_rad, ground::OpenLoopScope scope);

/// What is measured of it, and its verdict. Without number, seed, draws and times.
[[nodiscard]] RunRecord record_of(const Flight& flight, const CampaignPlan& plan);

/// The record of a run that has failed: without times.
[[nodiscard]] RunRecord failed(const CampaignPlan& plan, std::uint64_t run, std::string reason);

/// `flown`, which may be null, is given what was flown where the run did not fail; of a campaign of filters alone, the
/// same flight with all that fly() does. Does not throw for a run that fails; throws Stopped, std::bad_alloc, and what
/// `setup_of` throws.
[[nodiscard]] RunRecord perform(const CampaignPlan& plan, std::uint64_t run, const SetupOf& setup_of,
                                const std::function<void(Flight&&)>& flown = nullptr);

/// How many runs are best performed together: those of filters side by side in the lanes of a vector.
[[nodiscard]] std::size_t runs_together(const CampaignPlan& plan);
/// So many or fewer, with the results that perform() gives of each, in their order. Throws as that.
[[nodiscard]] std::vector<RunRecord> perform_together(const CampaignPlan& plan, std::span<const std::uint64_t> runs,
                                                      const SetupOf& setup_of);

/// Takes over records as they come: one call at a time, in no order.
using Collect = std::function<void(std::vector<RunRecord>&& records)>;

/// Performs runs side by side, those that are performed together on one core, and hands over records when they are
/// there. jobs: 1 or more threads. Throws as perform(), and what `collect` throws.
void perform_all(const CampaignPlan& plan, std::span<const std::uint64_t> runs, const SetupOf& setup_of, unsigned jobs,
                 const Collect& collect);

}  // namespace trihedron::campaign
