// trihedron_forecasts: flies passes open loop after their calibration and tabulates how many of the errors lie within
// what was predicted of them.

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "consistency/tables.hpp"
#include "forecasts/flight.hpp"
#include "stop_on_signals.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"

namespace {

using namespace trihedron;
using namespace trihedron::forecasts;

/// World, seed, estimator.
using Key = std::tuple<std::string, int, std::string>;
using Results = std::map<Key, std::vector<Forecast>>;

constexpr std::array<Estimator, 2> kEstimatorsFlown = {Estimator::kInvariant, Estimator::kBatch};
const Flight kFlight{std::chrono::hours(9),
                     {std::chrono::minutes(90), std::chrono::minutes(270), std::chrono::minutes(540)}};
constexpr const char* kHeader =
    "world,run,estimator,corrected_min,after_min,square,roll,pitch,heading,error_rad,error_997_rad,"
    "error_997_continued_rad";

std::string lines_of(const Key& key, const std::vector<Forecast>& forecasts) {
  std::string text;
  for (const Forecast& f : forecasts) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", std::get<0>(key), std::get<1>(key), std::get<2>(key),
                        f.corrected_min, f.after_min, f.square, f.in_sigmas.x(), f.in_sigmas.y(), f.in_sigmas.z(),
                        f.error_rad, f.error_997_rad, f.error_997_continued_rad);
  }
  return text;
}

/// What the file holds, if there is one.
Results kept_in(const std::filesystem::path& file) {
  Results results;
  std::ifstream input(file);
  std::string line;
  if (!input || !std::getline(input, line)) {
    return results;
  }
  if (line != kHeader) {
    throw std::runtime_error(file.string() + ": is not of this program; give another file");
  }
  while (std::getline(input, line)) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream row(line);
    Key key;
    Forecast f;
    if (!(row >> std::get<0>(key) >> std::get<1>(key) >> std::get<2>(key) >> f.corrected_min >> f.after_min >>
          f.square >> f.in_sigmas.x() >> f.in_sigmas.y() >> f.in_sigmas.z() >> f.error_rad >> f.error_997_rad >>
          f.error_997_continued_rad)) {
      throw std::runtime_error(file.string() + ": has a line that cannot be read: " + line);
    }
    results[key].push_back(f);
  }
  return results;
}

template <class Condition>
std::string share(const std::vector<Forecast>& forecasts, const Condition& condition) {
  const auto count = static_cast<double>(std::ranges::count_if(forecasts, condition));
  return fmt::format("{:.1f}", 100 * count / static_cast<double>(forecasts.size()));
}

std::string row(const std::string& name, const std::vector<Forecast>& forecasts) {
  // Squares within which 1, 2 and 3 sigmas of a normal variable have their shares, of χ² of three.
  constexpr std::array<double, 3> kSquares = {3.527, 8.025, 14.156};
  std::string text = fmt::format("| {} | {} ", name, forecasts.size());
  for (const double square : kSquares) {
    text += fmt::format("| {} ", share(forecasts, [&](const Forecast& f) { return f.square <= square; }));
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<std::string> shares;
    for (const double sigmas : {1.0, 2.0, 3.0}) {
      shares.push_back(share(forecasts, [&](const Forecast& f) { return std::abs(f.in_sigmas(axis)) <= sigmas; }));
    }
    text += fmt::format("| {} ", fmt::join(shares, " "));
  }
  std::vector<double> errors;
  for (const Forecast& f : forecasts) {
    errors.push_back(f.error_rad / kArcsecond);
  }
  std::ranges::nth_element(errors, errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2));
  return text +
         fmt::format("| {} | {} | {:.1f} |\n",
                     share(forecasts, [](const Forecast& f) { return f.error_rad <= f.error_997_rad; }),
                     share(forecasts, [](const Forecast& f) { return f.error_rad <= f.error_997_continued_rad; }),
                     errors[errors.size() / 2]);
}

std::string table(const Results& results) {
  std::string text =
      "| world, estimator, after | forecasts | 1σ | 2σ | 3σ | roll 1σ 2σ 3σ | pitch | heading | below 99.7 %, motion "
      "known "
      "| motion continued | median error, ″ |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
      "| *expected* | | 68.3 | 95.4 | 99.7 | 68.3 95.4 99.7 | 68.3 95.4 99.7 | 68.3 95.4 99.7 | 99.7 | | |\n";
  std::map<std::string, std::vector<Forecast>> all;
  for (const World& world : worlds()) {
    for (const Estimator estimator : kEstimatorsFlown) {
      std::map<double, std::vector<Forecast>> by_time;
      for (const auto& [key, forecasts] : results) {
        for (const Forecast& f : forecasts) {
          if (std::get<0>(key) == world.name && std::get<2>(key) == name_of(estimator)) {
            by_time[f.after_min].push_back(f);
            all[fmt::format("all, {}, {:.0f} min", name_of(estimator), f.after_min)].push_back(f);
          }
        }
      }
      for (const auto& [after_min, forecasts] : by_time) {
        text += row(fmt::format("{}, {}, {:.0f} min", world.name, name_of(estimator), after_min), forecasts);
      }
    }
  }
  for (const auto& [name, forecasts] : all) {
    text += row(name, forecasts);
  }
  return text;
}

int run(int argc, char** argv) {
  try {
    int runs = 20;
    std::filesystem::path resume;
    std::filesystem::path document;
    std::vector<std::string> only;
    unsigned threads = std::max(1U, std::thread::hardware_concurrency());
    CLI::App program(
        "Calibrates the first nine hours of simulated passes and flies them open loop through the next nine.");
    program.add_option("document", document, "Write the table into it, not to standard output");
    program.add_option("--runs", runs, "Passes of each world")->check(CLI::PositiveNumber)->capture_default_str();
    program.add_option("--worlds", only, "Only these")->delimiter(',');
    program.add_option("--threads", threads, "How many at once")->check(CLI::PositiveNumber)->capture_default_str();
    program.add_option("--resume", resume, "Keep each forecast in this file (CSV), and go on from it");
    CLI11_PARSE(program, argc, argv);

    Results results = kept_in(resume);
    struct Task {
      World world;
      int seed;
      Estimator estimator;
      [[nodiscard]] Key key() const { return {world.name, seed, std::string(name_of(estimator))}; }
    };
    std::vector<Task> tasks;
    for (int seed = 1; seed <= runs; ++seed) {
      for (const World& world : worlds()) {
        for (const Estimator estimator : kEstimatorsFlown) {
          Task task{world, seed, estimator};
          if ((only.empty() || std::ranges::find(only, world.name) != only.end()) && !results.contains(task.key())) {
            tasks.push_back(std::move(task));
          }
        }
      }
    }
    std::mutex one_at_a_time;
    std::size_t done = 0;
    const auto fly_one = [&](std::size_t i) {
      CalibrationOptions options;
      options.estimator = tasks[i].estimator;
      const std::vector<Forecast> forecasts = fly(tasks[i].world, tasks[i].seed, kFlight, options);
      const std::scoped_lock lock(one_at_a_time);
      results[tasks[i].key()] = forecasts;
      if (!resume.empty()) {
        const bool begins = !std::filesystem::exists(resume);
        std::ofstream output(resume, std::ios::app);
        if (!(output << (begins ? std::string(kHeader) + "\n" : "") << lines_of(tasks[i].key(), forecasts)).flush()) {
          throw std::runtime_error(resume.string() + ": cannot be written");
        }
      }
      fmt::print(stderr, "\r{} of {} calibrations", ++done, tasks.size());
    };
    ground::with_cores(threads, [&] { ground::for_each_on_all_cores(tasks.size(), fly_one); });
    fmt::print(stderr, "\n");
    if (document.empty()) {
      fmt::print("{}", table(results));
    } else {
      consistency::write_between_markers(document, "forecasts", table(results));
    }
    return 0;
  } catch (const trihedron::Stopped&) {
    throw;
  } catch (const std::exception& error) {
    fmt::print(stderr, "trihedron_forecasts: {}\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  return trihedron::cli::stopped_by_signals([argc, argv] { return run(argc, argv); });
}
