// trihedron_consistency: tabulates from the runs of a campaign whether the estimators' covariances are consistent, how
// good they are, and whether they agree.

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "consistency/bound.hpp"
#include "consistency/tables.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/io/campaign.hpp"
#include "trihedron/sim/simulate.hpp"

namespace {

using namespace trihedron;
using namespace trihedron::consistency;

constexpr const char* kEstimatorsTable = "estimators";
constexpr const char* kObservableTable = "observable";
constexpr const char* kAgreementTable = "agreement";

struct Options {
  std::string campaign;
  std::filesystem::path out;
  std::filesystem::path document;
  std::string place = "consistency";
  std::string table = kEstimatorsTable;
  std::string cells;
  std::size_t runs = std::numeric_limits<std::size_t>::max();
};

/// Of the flights of all these runs without process noise, by the seed, which each flight has for itself.
std::map<std::uint64_t, ParameterErrors> bounds_of(const Campaign& campaign, const io::CampaignFile& file) {
  std::map<std::uint64_t, const RunRecord*> flights;
  for (const Cell& cell : campaign.cells) {
    for (const RunRecord* run : cell.by_estimator.front()) {
      flights[run->seed] = run;
    }
  }
  std::map<std::uint64_t, ParameterErrors> bounds;
  std::vector<const RunRecord*> runs;
  for (const auto& [seed, run] : flights) {
    bounds[seed].setConstant(std::numeric_limits<double>::quiet_NaN());
    runs.push_back(run);
  }
  ground::for_each_on_all_cores(runs.size(), [&](std::size_t i) {
    const Scenario scenario = file.scenario(runs[i]->seed, runs[i]->draws);
    if (scenario.gyros.front().drift.direction_walk_rad_sqrt_s > 0) {
      return;
    }
    const sim::SimulatedPass flown = sim::simulate(scenario);
    bounds.at(runs[i]->seed) = parameter_bound(flown.pass.settings, flown.truth).diagonal();
  });
  return bounds;
}

std::string table(const Options& options) {
  const io::CampaignFile file(options.campaign, sim::expect_possible);
  const io::Journal journal = io::read_journal(options.out / "runs.journal");
  const std::string difference = io::difference_between(journal.identity, file.identity(journal.identity.at(0).text));
  if (!difference.empty()) {
    throw std::runtime_error(options.out.string() + " is of another campaign: " + difference);
  }
  Campaign campaign = campaign_of(file.plan(), journal.records, options.runs);
  const std::regex pattern(options.cells);
  std::erase_if(campaign.cells, [&](const Cell& cell) { return !std::regex_search(cell.name(), pattern); });
  if (campaign.cells.empty()) {
    throw std::runtime_error("no cell has a name like " + options.cells);
  }
  if (options.table == kAgreementTable) {
    return agreement_table(campaign);
  }
  if (options.table == kObservableTable) {
    return observable_table(campaign,
                            [&](const RunRecord& run) { return prior_covariance(file.scenario(run.seed, run.draws)); });
  }
  const std::map<std::uint64_t, ParameterErrors> bounds = bounds_of(campaign, file);
  return estimators_table(campaign, [&](const RunRecord& run) { return bounds.at(run.seed); });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App program(
        "Tabulates a campaign over a grid of simulated passes: whether the estimators' covariances hold, how good they "
        "are, and whether they agree.");
    program.add_option("campaign", options.campaign, "The file that the campaign was flown by")->required();
    program.add_option("out", options.out, "What trihedron campaign -o wrote")->required();
    program.add_option("document", options.document, "Write the table into it, not to standard output");
    program.add_option("--place", options.place, "Of the table in the document")->capture_default_str();
    program
        .add_option("--table", options.table,
                    "estimators: NEES, NIS, error over bound; observable: NEES of what the flights make observable; "
                    "agreement: of both estimators")
        ->check(CLI::IsMember({kEstimatorsTable, kObservableTable, kAgreementTable}))
        ->capture_default_str();
    program.add_option("--cells", options.cells, "Only cells with a name like this, e.g. '^none/.*/300arcmin'");
    program.add_option("--runs", options.runs, "Of each cell the first so many")->check(CLI::PositiveNumber);
    CLI11_PARSE(program, argc, argv);
    const std::string text = table(options);
    if (options.document.empty()) {
      fmt::print("{}", text);
    } else {
      write_between_markers(options.document, options.place, text);
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "trihedron_consistency: {}\n", error.what());
    return 1;
  }
}
