#include "consistency/results.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <istream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "consistency/band.hpp"

namespace trihedron::consistency {
namespace {

std::string marked(const std::string& value, int side) { return value + (side < 0 ? " ↓" : side > 0 ? " ↑" : ""); }

std::string angle(double rad) {
  return rad < kDegree ? fmt::format("{:.0f}′", rad / kArcminute) : fmt::format("{:.0f}°", rad / kDegree);
}

/// The columns that name the cell.
constexpr const char* kCellHead = "| slews | geometry | drift, rad/s | misalignment | random walk, rad/√s |";
constexpr const char* kCellRule = "| --- | --- | --- | --- | --- |";

std::string cell_columns(const Cell& cell) {
  return fmt::format("| {} | {} | {:.0e} | {} | {} |", cell.slews ? "slews" : "none", cell.geometry.name,
                     cell.drift_rad_s, angle(cell.misalignment_rad),
                     cell.walk_rad_sqrt_s > 0 ? fmt::format("{:.0e}", cell.walk_rad_sqrt_s) : "0");
}

/// A stream does not read "nan".
bool read(std::istream& words, double& number) {
  std::string word;
  words >> word;
  char* end = nullptr;
  number = std::strtod(word.c_str(), &end);
  return !word.empty() && *end == '\0';
}

}  // namespace

Results::Results(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream lines(file_);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    Key key;
    Outcome outcome;
    const bool whole = words >> key.cell >> key.run >> key.estimator >> outcome.fixes && read(words, outcome.nees) &&
                       read(words, outcome.observable.value) && read(words, outcome.observable.freedom) &&
                       read(words, outcome.nis) && read(words, outcome.error_over_bound_square) &&
                       read(words, outcome.by_parameter.square) && read(words, outcome.by_parameter.variance_ratio) &&
                       read(words, outcome.by_combination.square) && read(words, outcome.by_combination.variance_ratio);
    if (!whole) {
      throw std::runtime_error(fmt::format("{}: not a result: {}", file_.string(), line));
    }
    outcomes_[key] = outcome;
  }
}

void Results::add(const Key& key, const Outcome& outcome) {
  outcomes_[key] = outcome;
  if (!file_.empty()) {
    std::ofstream lines(file_, std::ios::app);
    lines << fmt::format("{} {} {} {} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g}\n", key.cell,
                         key.run, key.estimator, outcome.fixes, outcome.nees, outcome.observable.value,
                         outcome.observable.freedom, outcome.nis, outcome.error_over_bound_square,
                         outcome.by_parameter.square, outcome.by_parameter.variance_ratio,
                         outcome.by_combination.square, outcome.by_combination.variance_ratio);
    if (!lines.flush()) {
      throw std::runtime_error(file_.string() + ": cannot be written");
    }
  }
}

Outcome Results::mean_of(const Cell& cell, const Column& column) const {
  Outcome mean;
  const auto add = [&](double& sum, double value) { sum += value / column.runs; };
  for (int run = 1; run <= column.runs; ++run) {
    const Outcome& outcome = outcomes_.at({cell.name(), run, column.estimator});
    add(mean.nees, outcome.nees);
    add(mean.observable.value, outcome.observable.value);
    add(mean.observable.freedom, outcome.observable.freedom);
    add(mean.error_over_bound_square, outcome.error_over_bound_square);
    add(mean.by_parameter.square, outcome.by_parameter.square);
    add(mean.by_parameter.variance_ratio, outcome.by_parameter.variance_ratio);
    add(mean.by_combination.square, outcome.by_combination.square);
    add(mean.by_combination.variance_ratio, outcome.by_combination.variance_ratio);
    mean.nis += outcome.nis * static_cast<double>(outcome.fixes);
    mean.fixes += outcome.fixes;
  }
  mean.nis /= static_cast<double>(mean.fixes);
  return mean;
}

std::string Results::table(const std::vector<Cell>& cells, const std::vector<Column>& columns) const {
  std::string head = kCellHead;
  std::string rule = kCellRule;
  for (const Column& column : columns) {
    head += fmt::format(" NEES, {0} | NIS | error / bound |", column.estimator);
    rule += " --- | --- | --- |";
  }
  std::string text = head + "\n" + rule + "\n";
  std::map<std::string, std::array<int, 2>> outside;  // per estimator: up to 1°, beyond
  std::array<int, 2> rows{};
  for (const Cell& cell : cells) {
    text += cell_columns(cell);
    const std::size_t far = cell.misalignment_rad > 1.5 * kDegree ? 1 : 0;
    ++rows[far];
    for (const Column& column : columns) {
      const Outcome mean = mean_of(cell, column);
      const int side = band_of_mean(kParameters, column.runs).side(mean.nees);
      outside[column.estimator][far] += side != 0 ? 1 : 0;
      const double over_bound = std::sqrt(mean.error_over_bound_square);
      text +=
          fmt::format(" {} | {} | {} |", marked(fmt::format("{:.1f}", mean.nees), side),
                      marked(fmt::format("{:.3f}", mean.nis), band_of_mean(kInnovations, mean.fixes).side(mean.nis)),
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

std::string Results::observable_table(const std::vector<Cell>& cells, const std::vector<Column>& columns) const {
  std::string head = kCellHead;
  std::string rule = kCellRule;
  for (const Column& column : columns) {
    head += fmt::format(" NEES of the observable, {} | of | band |", column.estimator);
    rule += " --- | --- | --- |";
  }
  std::string text = head + "\n" + rule + "\n";
  std::map<std::string, int> outside;  // per estimator
  for (const Cell& cell : cells) {
    text += cell_columns(cell);
    for (const Column& column : columns) {
      const Nees nees = mean_of(cell, column).observable;
      const Band band = band_of_mean(nees.freedom, column.runs);
      const int side = band.side(nees.value);
      outside[column.estimator] += side != 0 ? 1 : 0;
      text += fmt::format(" {} | {:.2f} | {:.1f} … {:.1f} |", marked(fmt::format("{:.1f}", nees.value), side),
                          nees.freedom, band.low, band.high);
    }
    text += "\n";
  }
  text += "\n";
  for (const auto& [estimator, count] : outside) {
    text += fmt::format("NEES of the observable, {}: outside its band in {} of {} rows.  \n", estimator, count,
                        cells.size());
  }
  return text;
}

std::string Results::agreement_table(const std::vector<Cell>& cells, int runs) const {
  const auto columns = [](const Difference& difference) {
    return fmt::format(" {} | {:.3f} |",
                       marked(fmt::format("{:.2f}", std::sqrt(difference.square)), agrees(difference) ? 0 : 1),
                       std::sqrt(difference.variance_ratio));
  };
  std::string text = fmt::format(
      "{} difference by parameter, σ | σ ratio | difference by combination, σ | σ ratio |\n"
      "{} --- | --- | --- | --- |\n",
      kCellHead, kCellRule);
  int beyond_by_parameter = 0;
  int beyond_by_combination = 0;
  for (const Cell& cell : cells) {
    const Outcome mean = mean_of(cell, {"batch", runs});
    beyond_by_parameter += agrees(mean.by_parameter) ? 0 : 1;
    beyond_by_combination += agrees(mean.by_combination) ? 0 : 1;
    text += cell_columns(cell) + columns(mean.by_parameter) + columns(mean.by_combination) + "\n";
  }
  return text + fmt::format("\nBeyond what is allowed: by parameter {}, by combination {} of {} rows.  \n",
                            beyond_by_parameter, beyond_by_combination, cells.size());
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
