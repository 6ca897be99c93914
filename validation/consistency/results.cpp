#include "consistency/results.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "consistency/band.hpp"

namespace trihedron::consistency {
namespace {

std::string marked(std::string value, int side) { return value + (side < 0 ? " ↓" : side > 0 ? " ↑" : ""); }

std::string angle(double rad) {
  return rad < kDegree ? fmt::format("{:.0f}′", rad / kArcminute) : fmt::format("{:.0f}°", rad / kDegree);
}

}  // namespace

Results::Results(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream lines(file_);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    Key key;
    Outcome outcome;
    std::string nis;  // a stream does not read "nan"
    std::string over_bound;
    if (!(words >> key.cell >> key.run >> key.estimator >> outcome.nees >> nis >> outcome.fixes >> over_bound)) {
      throw std::runtime_error(fmt::format("{}: not a result: {}", file_.string(), line));
    }
    outcome.nis = std::stod(nis);
    outcome.error_over_bound_square = std::stod(over_bound);
    outcomes_[key] = outcome;
  }
}

void Results::add(const Key& key, const Outcome& outcome) {
  outcomes_[key] = outcome;
  if (!file_.empty()) {
    std::ofstream lines(file_, std::ios::app);
    lines << fmt::format("{} {} {} {:.7g} {:.7g} {} {:.7g}\n", key.cell, key.run, key.estimator, outcome.nees,
                         outcome.nis, outcome.fixes, outcome.error_over_bound_square);
    if (!lines.flush()) {
      throw std::runtime_error(file_.string() + ": cannot be written");
    }
  }
}

std::string Results::table(const std::vector<Cell>& cells, const std::vector<Column>& columns) const {
  std::string head = "| slews | geometry | drift, rad/s | misalignment | random walk, rad/√s |";
  std::string rule = "| --- | --- | --- | --- | --- |";
  for (const Column& column : columns) {
    head += fmt::format(" NEES, {0} | NIS | error / bound |", column.estimator);
    rule += " --- | --- | --- |";
  }
  std::string text = head + "\n" + rule + "\n";
  std::map<std::string, std::array<int, 2>> outside;  // per estimator: up to 1°, beyond
  std::array<int, 2> rows{};
  for (const Cell& cell : cells) {
    text += fmt::format("| {} | {} | {:.0e} | {} | {} |", cell.slews ? "slews" : "none", cell.geometry.name,
                        cell.drift_rad_s, angle(cell.misalignment_rad),
                        cell.walk_rad_sqrt_s > 0 ? fmt::format("{:.0e}", cell.walk_rad_sqrt_s) : "0");
    const std::size_t far = cell.misalignment_rad > 1.5 * kDegree ? 1 : 0;
    ++rows[far];
    for (const auto& [estimator, runs] : columns) {
      Outcome mean;
      mean.error_over_bound_square = 0;
      for (int run = 1; run <= runs; ++run) {
        const Outcome& outcome = outcomes_.at({cell.name(), run, estimator});
        mean.nees += outcome.nees / runs;
        mean.nis += outcome.nis * static_cast<double>(outcome.fixes);
        mean.fixes += outcome.fixes;
        mean.error_over_bound_square += outcome.error_over_bound_square / runs;
      }
      mean.nis /= static_cast<double>(mean.fixes);
      const int side = band_of_mean(kParameters, runs).side(mean.nees);
      outside[estimator][far] += side != 0 ? 1 : 0;
      const double over_bound = std::sqrt(mean.error_over_bound_square);
      text += fmt::format(" {} | {} | {} |", marked(fmt::format("{:.1f}", mean.nees), side),
                          std::isnan(mean.nis) ? ""
                                               : marked(fmt::format("{:.3f}", mean.nis),
                                                        band_of_mean(kInnovations, mean.fixes).side(mean.nis)),
                          std::isnan(over_bound) ? "" : fmt::format("{:.2f}", over_bound));
    }
    text += "\n";
  }
  text += "\n";
  for (const auto& [estimator, count] : outside) {
    text += fmt::format("NEES, {}: outside its band in {} of {} rows up to 1°, in {} of {} beyond.  \n", estimator,
                        count[0], rows[0], count[1], rows[1]);
  }
  return text;
}

void write_between_markers(const std::filesystem::path& document, const std::string& place, const std::string& text) {
  std::ifstream input(document);
  std::string page(std::istreambuf_iterator<char>(input), {});
  const std::string begin = fmt::format("<!-- {} -->\n", place);
  const std::size_t from = page.find(begin);
  const std::size_t to = page.find("<!-- end -->", from);
  if (from == std::string::npos || to == std::string::npos) {
    throw std::runtime_error(document.string() + ": has no place for the table");
  }
  page.replace(from + begin.size(), to - from - begin.size(), text);
  if (!(std::ofstream(document) << page).flush()) {
    throw std::runtime_error(document.string() + ": cannot be written");
  }
}

}  // namespace trihedron::consistency
