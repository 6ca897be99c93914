// trihedron_consistency: simulates a grid of flights and tabulates whether the estimators' covariances are consistent.

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <mutex>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "consistency/band.hpp"
#include "consistency/flight.hpp"
#include "consistency/grid.hpp"
#include "consistency/results.hpp"
#include "stop_on_signals.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"

namespace {

using namespace trihedron::consistency;
using namespace trihedron;

constexpr const char* kEstimatorsTable = "estimators";
constexpr const char* kObservableTable = "observable";
constexpr const char* kAgreementTable = "agreement";

struct Options {
  int runs = 100;
  int paper_runs = 20;  // fewer runs suffice: its NEES is far from consistent
  std::string cells;
  std::vector<std::string> estimators{std::string(name_of(Estimator::kPaper)),
                                      std::string(name_of(Estimator::kInvariant))};
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  std::filesystem::path resume;
  std::filesystem::path document;
  std::string place = "consistency";
  std::string table = kEstimatorsTable;
};

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const EstimatorRow& row : kEstimators) {
    names.emplace_back(row.name);
  }
  return names;
}

/// A flight still to be simulated, and the estimators to run on it.
struct Task {
  const Cell& cell;
  int run;
  std::vector<std::string> estimators;
};

std::vector<Column> columns_of(const Options& options) {
  if (options.table == kAgreementTable) {
    return {{std::string(name_of(Estimator::kBatch)), options.runs}};
  }
  std::vector<Column> columns;
  for (const std::string& estimator : options.estimators) {
    const bool is_paper = estimator_named(estimator) == Estimator::kPaper;
    columns.push_back({estimator, is_paper ? std::min(options.runs, options.paper_runs) : options.runs});
  }
  return columns;
}

/// Ordered by run, then by cell, so that an interrupted campaign leaves a complete table of fewer runs.
std::vector<Task> missing(const Results& results, const std::vector<Cell>& cells, const std::vector<Column>& columns,
                          int runs) {
  std::vector<Task> tasks;
  for (int run = 1; run <= runs; ++run) {
    for (const Cell& cell : cells) {
      Task task{cell, run, {}};
      for (const auto& [estimator, its_runs] : columns) {
        if (run <= its_runs && !results.contains({cell.name(), run, estimator})) {
          task.estimators.push_back(estimator);
        }
      }
      if (!task.estimators.empty()) {
        tasks.push_back(task);
      }
    }
  }
  return tasks;
}

/// Makes the flights on all threads; which of them makes which does not matter.
void fly_all(const std::vector<Task>& tasks, unsigned threads, Results& results) {
  std::size_t done = 0;
  std::mutex one_at_a_time;
  const auto fly_one = [&](std::size_t i) {
    const Task& task = tasks[i];
    std::vector<Estimator> estimators;
    for (const std::string& name : task.estimators) {
      estimators.push_back(estimator_named(name).value());
    }
    const std::vector<Outcome> outcomes = fly(task.cell, task.run, estimators);
    const std::scoped_lock lock(one_at_a_time);
    for (std::size_t k = 0; k < outcomes.size(); ++k) {
      results.add({task.cell.name(), task.run, task.estimators[k]}, outcomes[k]);
    }
    fmt::print(stderr, "\r{} of {} flights", ++done, tasks.size());
  };
  using namespace trihedron::ground;
  with_cores(threads, [&] { for_each_on_all_cores(tasks.size(), fly_one); });
}

std::string measured(const Options& options) {
  std::vector<Cell> cells = grid();
  const std::regex pattern(options.cells);
  std::erase_if(cells, [&](const Cell& cell) { return !std::regex_search(cell.name(), pattern); });
  Results results(options.resume);
  const std::vector<Column> columns = columns_of(options);
  fly_all(missing(results, cells, columns, options.runs), options.threads, results);
  fmt::print(stderr, "\n");
  if (options.table == kAgreementTable) {
    return fmt::format("{} runs per row.\n\n", options.runs) + results.agreement_table(cells, options.runs);
  }
  const bool observable = options.table == kObservableTable;
  std::string text;
  for (const auto& [estimator, runs] : columns) {
    text += fmt::format("{}: {} runs per row", estimator, runs);
    if (!observable) {
      const Band nees = band_of_mean(kParameters, runs);
      text += fmt::format("; 95 % of the means of a consistent estimator's NEES lie in {:.1f} … {:.1f}", nees.low,
                          nees.high);
    }
    text += ".  \n";
  }
  return text + "\n" + (observable ? results.observable_table(cells, columns) : results.table(cells, columns));
}

int run(int argc, char** argv) {
  try {
    Options options;
    CLI::App program(
        "Flies a grid of simulated passes: whether the estimators' covariances hold, how good they are, and "
        "whether they agree.");
    program.add_option("document", options.document, "Write the table into it, not to standard output");
    program.add_option("--place", options.place, "Of the table in the document")->capture_default_str();
    program
        .add_option("--table", options.table,
                    "estimators: NEES, NIS, error over bound; observable: NEES of what the flights make observable; "
                    "agreement: of estimators invariant and batch")
        ->check(CLI::IsMember({kEstimatorsTable, kObservableTable, kAgreementTable}))
        ->capture_default_str();
    program.add_option("--runs", options.runs, "Flights per cell")->check(CLI::PositiveNumber)->capture_default_str();
    program.add_option("--paper-runs", options.paper_runs, "Those of them that estimator paper sees")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    program.add_option("--cells", options.cells, "Only cells with a name like this, e.g. '^steady/.*/300arcmin'");
    program.add_option("--estimators", options.estimators, "Which")
        ->check(CLI::IsMember(estimator_names()))
        ->delimiter(',')
        ->capture_default_str();
    program.add_option("--threads", options.threads, "How many at once")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    program.add_option("--resume", options.resume, "Keep the outcome of each flight in this file, and go on from it");
    CLI11_PARSE(program, argc, argv);
    const std::string text = measured(options);
    if (options.document.empty()) {
      fmt::print("{}", text);
    } else {
      write_between_markers(options.document, options.place, text);
    }
    return 0;
  } catch (const trihedron::Stopped&) {
    throw;
  } catch (const std::exception& error) {
    fmt::print(stderr, "trihedron_consistency: {}\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  return trihedron::cli::stopped_by_signals([argc, argv] { return run(argc, argv); });
}
