#pragma once
/// What is drawn for a run. It depends on (seed of the campaign, number of the flight, key of the value) alone: on no
/// other run, no other key and no order of work. Each flight is calibrated once by every point of the grids over
/// settings; without these the number of the flight is that of the run.

#include <cstdint>
#include <string_view>
#include <vector>

#include "trihedron/records/campaign.hpp"

namespace trihedron::campaign {

/// Different flights: all runs without those that differ in grids over settings only.
[[nodiscard]] std::uint64_t flights_of(const CampaignPlan& plan);
/// Number of the flight that a run calibrates, below flights_of().
[[nodiscard]] std::uint64_t flight_of_run(const CampaignPlan& plan, std::uint64_t run);

/// Seed of the run's scenario; fits into 63 bits, which is what TOML holds.
[[nodiscard]] std::uint64_t seed_of_run(const CampaignPlan& plan, std::uint64_t run);

/// One per input: a number in its unit, or the place of an option. run: below plan.runs.
[[nodiscard]] std::vector<double> draws_of_run(const CampaignPlan& plan, std::uint64_t run);

/// Uniform in (0, 1), never 0 or 1.
[[nodiscard]] double uniform_of(std::uint64_t seed, std::uint64_t flight, std::string_view key);

/// The value below which `u` of the distribution lies; of options the place of one. 0 < u < 1; not of kGrid and
/// kFollows.
[[nodiscard]] double quantile_of(const Distribution& distribution, double u);

/// Where `i` of 0 … count − 1 stands in an order drawn from `key`: a permutation that needs no memory, by a Feistel
/// network over the next power of four, walked until it is within.
[[nodiscard]] std::uint64_t permuted(std::uint64_t i, std::uint64_t count, std::uint64_t key);

}  // namespace trihedron::campaign
