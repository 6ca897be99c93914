#include "consistency/tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "trihedron/campaign/summary.hpp"

namespace trihedron::consistency {
namespace {

using campaign::Consistency;

constexpr const char* kEstimator = "calibration.estimator";
/// The values of a cell, in the order of the columns, and what they are called there.
constexpr std::array<std::pair<const char*, const char*>, 5> kValues = {
    {{"attitude", "slews"},
     {"gyro.unit", "geometry"},
     {"gyro.drift.prior_sigma", "drift"},
     {"gyro.misalignment_magnitude", "misalignment"},
     {"gyro.drift.direction_walk", "random walk"}}};
constexpr double kFar_arcmin = 90;  ///< up to 1° and beyond are counted apart

std::size_t input_named(const CampaignPlan& plan, std::string_view key) {
  const auto found = std::ranges::find(plan.inputs, key, &CampaignInput::key);
  if (found == plan.inputs.end() || found->distribution.kind != Distribution::Kind::kGrid) {
    throw std::runtime_error(fmt::format("the campaign has no grid over {}", key));
  }
  return static_cast<std::size_t>(found - plan.inputs.begin());
}

std::string marked(const std::string& value, int side) { return value + (side < 0 ? " ↓" : side > 0 ? " ↑" : ""); }

/// Heads of the columns that name the cell and then of `count` columns for each of some estimators.
std::string head(const std::vector<std::string>& columns) {
  std::string names = "|";
  std::string rule = "|";
  const auto add = [&](const std::string& name) {
    names += fmt::format(" {} |", name);
    rule += " --- |";
  };
  for (const auto& [key, name] : kValues) {
    add(name);
  }
  for (const std::string& name : columns) {
    add(name);
  }
  return names + "\n" + rule + "\n";
}

std::string begin_of_row(const Cell& cell) { return fmt::format("| {} |", fmt::join(cell.values, " | ")); }

/// A mean over runs or fixes, and where 95 % of such means lie.
Consistency consistency_of(const Runs& runs, const std::function<Nees(const RunRecord&)>& of) {
  double sum = 0;
  double freedom = 0;
  for (const RunRecord* run : runs) {
    const Nees nees = of(*run);
    sum += nees.value;
    freedom += nees.freedom;
  }
  return campaign::consistency_of(sum, freedom, static_cast<double>(runs.size()));
}

Consistency nees_of(const Runs& runs) {
  return consistency_of(runs, [](const RunRecord& run) { return Nees{run.at(RunQuantity::kNees), Parameters::kSize}; });
}

/// Of all fixes, rejected ones as well: there are no outliers.
Consistency nis_of(const Runs& runs) {
  double sum = 0;
  double fixes = 0;
  for (const RunRecord* run : runs) {
    sum += run->at(RunQuantity::kNisMeanOfAll) * run->at(RunQuantity::kNisFixesOfAll);
    fixes += run->at(RunQuantity::kNisFixesOfAll);
  }
  return campaign::consistency_of(sum, 2 * kGyros * fixes, fixes);
}

double error_over_bound(const Runs& runs, const BoundOf& bound_of) {
  double square = 0;
  for (const RunRecord* run : runs) {
    square += errors_of(*run).cwiseAbs2().cwiseQuotient(bound_of(*run)).mean();
  }
  return std::sqrt(square / static_cast<double>(runs.size()));
}

/// Which runs of each estimator there are.
std::string runs_line(const Campaign& campaign, bool with_band) {
  std::string text;
  for (std::size_t i = 0; i < campaign.estimators.size(); ++i) {
    const Runs& runs = campaign.cells.front().by_estimator[i];
    text += fmt::format("{}: {} runs per row", campaign.estimators[i], runs.size());
    if (with_band) {
      const Consistency band = nees_of(runs);
      text += fmt::format("; 95 % of the means of a consistent estimator's NEES lie in {:.1f} … {:.1f}",
                          band.usual.low * band.freedom, band.usual.high * band.freedom);
    }
    text += ".  \n";
  }
  return text + "\n";
}

bool is_far(const Cell& cell) { return std::stod(cell.values[3]) > kFar_arcmin; }

}  // namespace

std::string Cell::name() const { return fmt::format("{}", fmt::join(values, "/")); }

std::vector<std::string> values_of(const CampaignPlan& plan, std::span<const double> draws) {
  std::vector<std::string> values;
  for (const auto& [key, name] : kValues) {
    const std::size_t input = input_named(plan, key);
    values.push_back(campaign::text_of_draw(plan.inputs[input], draws[input]));
  }
  return values;
}

Campaign campaign_of(const CampaignPlan& plan, std::span<const RunRecord> records, std::size_t runs) {
  if (records.size() != plan.runs) {
    throw std::runtime_error(fmt::format("{} of {} runs are there: go on with --resume", records.size(), plan.runs));
  }
  const std::size_t estimator = input_named(plan, kEstimator);
  Campaign campaign{plan.inputs[estimator].options, {}};
  std::vector<std::size_t> inputs;
  for (const auto& [key, name] : kValues) {
    inputs.push_back(input_named(plan, key));
  }
  std::map<std::vector<double>, Cell> cells;
  for (const RunRecord& run : records) {
    std::vector<double> point;
    for (const std::size_t input : inputs) {
      point.push_back(run.draws[input]);
    }
    Cell& cell = cells[point];
    if (cell.values.empty()) {
      cell.values = values_of(plan, run.draws);
      cell.by_estimator.resize(campaign.estimators.size());
    }
    Runs& its = cell.by_estimator[static_cast<std::size_t>(run.draws[estimator])];
    if (its.size() < runs) {
      its.push_back(&run);
    }
  }
  for (auto& [point, cell] : cells) {
    campaign.cells.push_back(std::move(cell));
  }
  return campaign;
}

ParameterErrors errors_of(const RunRecord& run) {
  ParameterErrors errors;
  for (int gyro = 0; gyro < kGyros; ++gyro) {
    for (int i = 0; i < Esg7::kSize; ++i) {
      errors(Parameters::drift(gyro) + i) =
          run.at(RunQuantity::kDriftError, static_cast<std::size_t>(gyro * Esg7::kSize + i));
    }
    for (int axis = 0; axis < 3; ++axis) {
      errors(Parameters::alignment(gyro) + axis) =
          run.at(RunQuantity::kAlignmentError, static_cast<std::size_t>(gyro * 3 + axis));
    }
  }
  return errors;
}

ParameterCovariance covariance_of(const RunRecord& run) {
  // Its order is that of Parameters.
  return ParameterCovariance::NullaryExpr([&](Eigen::Index row, Eigen::Index column) {
    return run.at(RunQuantity::kCovariance, static_cast<std::size_t>(row * Parameters::kSize + column));
  });
}

std::string estimators_table(const Campaign& campaign, const BoundOf& bound_of) {
  std::vector<std::string> columns;
  for (const std::string& estimator : campaign.estimators) {
    columns.insert(columns.end(), {"NEES, " + estimator, "NIS", "error / bound"});
  }
  std::string text = runs_line(campaign, true) + head(columns);
  std::map<std::string, std::array<int, 2>> outside;  // per estimator: up to 1°, beyond
  std::array<int, 2> rows{};
  for (const Cell& cell : campaign.cells) {
    text += begin_of_row(cell);
    const std::size_t far = is_far(cell) ? 1 : 0;
    ++rows[far];
    for (std::size_t i = 0; i < campaign.estimators.size(); ++i) {
      const Consistency nees = nees_of(cell.by_estimator[i]);
      const Consistency nis = nis_of(cell.by_estimator[i]);
      const double over_bound = error_over_bound(cell.by_estimator[i], bound_of);
      outside[campaign.estimators[i]][far] += nees.side() != 0 ? 1 : 0;
      text += fmt::format(" {} | {} | {} |", marked(fmt::format("{:.1f}", nees.mean), nees.side()),
                          marked(fmt::format("{:.3f}", nis.mean), nis.side()),
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

std::string observable_table(const Campaign& campaign, const PriorOf& prior_of) {
  std::vector<std::string> columns;
  for (const std::string& estimator : campaign.estimators) {
    columns.insert(columns.end(), {"NEES of the observable, " + estimator, "of", "band"});
  }
  std::string text = runs_line(campaign, false) + head(columns);
  std::map<std::string, int> outside;  // per estimator
  for (const Cell& cell : campaign.cells) {
    text += begin_of_row(cell);
    for (std::size_t i = 0; i < campaign.estimators.size(); ++i) {
      const Consistency nees = consistency_of(cell.by_estimator[i], [&](const RunRecord& run) {
        return observable_nees(errors_of(run), covariance_of(run), prior_of(run));
      });
      outside[campaign.estimators[i]] += nees.side() != 0 ? 1 : 0;
      text += fmt::format(" {} | {:.2f} | {:.1f} … {:.1f} |", marked(fmt::format("{:.1f}", nees.mean), nees.side()),
                          nees.freedom, nees.usual.low * nees.freedom, nees.usual.high * nees.freedom);
    }
    text += "\n";
  }
  text += "\n";
  for (const auto& [estimator, count] : outside) {
    text += fmt::format("NEES of the observable, {}: outside its band in {} of {} rows.  \n", estimator, count,
                        campaign.cells.size());
  }
  return text;
}

std::string agreement_table(const Campaign& campaign) {
  if (campaign.estimators.size() != 2) {
    throw std::runtime_error("the campaign has not two estimators");
  }
  const auto columns = [](const Difference& difference) {
    return fmt::format(" {} | {:.3f} |",
                       marked(fmt::format("{:.2f}", std::sqrt(difference.square)), agrees(difference) ? 0 : 1),
                       std::sqrt(difference.variance_ratio));
  };
  std::string text = fmt::format("{} runs per row.\n\n", campaign.cells.front().by_estimator.front().size()) +
                     head({"difference by parameter, σ", "σ ratio", "difference by combination, σ", "σ ratio"});
  int beyond_by_parameter = 0;
  int beyond_by_combination = 0;
  for (const Cell& cell : campaign.cells) {
    const Runs& first = cell.by_estimator[0];
    const Runs& second = cell.by_estimator[1];
    Difference by_parameter;
    Difference by_combination;
    for (std::size_t run = 0; run < first.size(); ++run) {
      // The errors are small rotations of the truth: what they differ by is what the estimates differ by.
      const ParameterErrors difference = errors_of(*second[run]) - errors_of(*first[run]);
      const ParameterCovariance of_first = covariance_of(*first[run]);
      const ParameterCovariance of_second = covariance_of(*second[run]);
      by_parameter += difference_by_parameter(difference, of_first, of_second);
      by_combination += difference_by_combination(difference, of_first, of_second);
    }
    by_parameter /= static_cast<double>(first.size());
    by_combination /= static_cast<double>(first.size());
    beyond_by_parameter += agrees(by_parameter) ? 0 : 1;
    beyond_by_combination += agrees(by_combination) ? 0 : 1;
    text += begin_of_row(cell) + columns(by_parameter) + columns(by_combination) + "\n";
  }
  return text + fmt::format("\nBeyond what is allowed: by parameter {}, by combination {} of {} rows.  \n",
                            beyond_by_parameter, beyond_by_combination, campaign.cells.size());
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
