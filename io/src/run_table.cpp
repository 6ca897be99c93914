#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "netcdf_file.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/campaign.hpp"
#include "trihedron/records/parameter_id.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRun = "run";

/// Dimensions after that of the runs.
std::vector<std::string> dimensions_of(RunShape shape) {
  switch (shape) {
    case RunShape::kOne:
      return {};
    case RunShape::kAxis:
      return {"axis"};
    case RunShape::kQuantile:
      return {"quantile"};
    case RunShape::kGyroAndAxis:
      return {"gyro", "axis"};
    case RunShape::kGyroAndCoefficient:
      return {"gyro", "coefficient"};
    case RunShape::kTwoParameters:
      return {"parameter", "other_parameter"};
  }
  return {};
}

template <class Value, class Of>
std::vector<Value> column(std::span<const RunRecord> records, const Of& of) {
  std::vector<Value> values;
  values.reserve(records.size());
  for (const RunRecord& record : records) {
    values.push_back(of(record));
  }
  return values;
}

/// "gyro.readout.noise": "input_gyro_readout_noise"; numbered where two keys would have one name.
std::string name_of_input(const std::string& key, std::map<std::string, int>& taken) {
  std::string name = "input_" + key;
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  const int number = ++taken[name];
  return number == 1 ? name : fmt::format("{}_{}", name, number);
}

ShapedVariable input_variable(const CampaignPlan& plan, std::size_t i, const std::string& name,
                              std::span<const RunRecord> records) {
  const CampaignInput& input = plan.inputs[i];
  const char* const where = input.is_setting() ? ", a setting of the calibration" : " of the scenario";
  ShapedVariable variable{name, {kRun}, {}, {{"long_name", input.key + where}, {"key", input.key}}};
  if (input.is_number()) {
    variable.values = column<double>(records, [&](const RunRecord& record) { return input.shown(record.draws[i]); });
    variable.attributes.emplace_back("units", input.unit.empty() ? "1" : input.unit);
  } else {
    variable.values = column<std::string>(
        records, [&](const RunRecord& record) { return input.options[static_cast<std::size_t>(record.draws[i])]; });
  }
  return variable;
}

ShapedVariable quantity_variable(const CampaignPlan& plan, const RunQuantityRow& row,
                                 std::span<const RunRecord> records) {
  std::vector<std::string> dimensions = dimensions_of(row.shape);
  dimensions.insert(dimensions.begin(), kRun);
  std::vector<double> values;
  const std::size_t size = size_of(row.shape, plan.gyros);
  values.reserve(size * records.size());
  for (const RunRecord& record : records) {
    for (std::size_t k = 0; k < size; ++k) {
      values.push_back(record.at(row.quantity, k));
    }
  }
  return {std::string(row.name),
          std::move(dimensions),
          std::move(values),
          {{"units", std::string(row.unit)}, {"long_name", std::string(row.about)}}};
}

/// As covariance has them: "gyro1.k0".
std::vector<std::string> names_of_parameters(std::size_t gyros) {
  std::vector<std::string> names;
  for (const ParameterId& parameter : drift_and_alignment(kEsg7, gyros)) {
    names.push_back(name_of(parameter));
  }
  return names;
}

}  // namespace

void write_run_table(const fs::path& file, const CampaignPlan& plan, std::string_view digest,
                     std::span<const RunRecord> records) {
  std::vector<std::pair<std::string, std::size_t>> dimensions = {{kRun, records.size()},
                                                                 {"gyro", plan.gyros},
                                                                 {"axis", 3},
                                                                 {"coefficient", kCampaignCoefficients},
                                                                 {"quantile", kErrorQuantiles.size()}};
  std::vector<std::int64_t> gyros;
  for (std::size_t k = 0; k < plan.gyros; ++k) {
    gyros.push_back(static_cast<std::int64_t>(k) + 1);
  }
  const auto whole = [&](const auto& of) { return column<std::int64_t>(records, of); };
  std::vector<ShapedVariable> variables = {
      {kRun,
       {kRun},
       whole([](const RunRecord& record) { return static_cast<std::int64_t>(record.run); }),
       {{"long_name", "number of the run, which --only takes"}, {"units", "1"}}},
      {"gyro", {"gyro"}, gyros, {{"long_name", "number of the gyro"}, {"units", "1"}}},
      {"axis", {"axis"}, std::vector<std::string>{"x", "y", "z"}, {{"long_name", "axis of c: roll, pitch, heading"}}},
      {"coefficient",
       {"coefficient"},
       std::vector<std::string>(Esg7::kNames.begin(), Esg7::kNames.end()),
       {{"long_name", "drift coefficient of eq. (1)"}}},
      {"quantile",
       {"quantile"},
       std::vector<double>(kErrorQuantiles.begin(), kErrorQuantiles.end()),
       {{"long_name", "share of the epochs of a run; 1: the largest error"}, {"units", "1"}}},
      {"seed",
       {kRun},
       whole([](const RunRecord& record) { return static_cast<std::int64_t>(record.seed); }),
       {{"long_name", "seed of the scenario"}, {"units", "1"}}},
      {"outcome",
       {kRun},
       whole([](const RunRecord& record) { return static_cast<std::int64_t>(record.outcome); }),
       {{"long_name", "verdict of the calibration, or that the run failed"},
        {"flag_values", "0, 1, 2"},
        {"flag_meanings", "trustworthy do_not_use failed"}}},
      {"reason",
       {kRun},
       column<std::string>(records, [](const RunRecord& record) { return record.reason; }),
       {{"long_name", "why the run failed; empty where it did not"}}},
      {"drift_model",
       {kRun},
       column<std::string>(records, [](const RunRecord& record) { return record.drift_model; }),
       {{"long_name", "drift model that the calibration used"}}},
      {"findings",
       {kRun},
       column<std::string>(records,
                           [](const RunRecord& record) { return fmt::format("{}", fmt::join(record.findings, " ")); }),
       {{"long_name", "codes of the findings of the verdict"}}}};
  std::map<std::string, int> taken;
  for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
    variables.push_back(input_variable(plan, i, name_of_input(plan.inputs[i].key, taken), records));
  }
  if (plan.keeps_covariance) {
    const std::vector<std::string> names = names_of_parameters(plan.gyros);
    for (const char* const dimension : {"parameter", "other_parameter"}) {
      dimensions.emplace_back(dimension, names.size());
      variables.push_back({dimension,
                           {dimension},
                           names,
                           {{"long_name", "drift coefficient of eq. (1), or alignment about an axis of c"}}});
    }
  }
  for (const RunQuantityRow& row : kRunQuantityRows) {
    if (plan.has(row.quantity)) {
      variables.push_back(quantity_variable(plan, row, records));
    }
  }

  NetcdfWriter writer(file);
  writer.write_attribute("", "Conventions", "CF-1.10");
  writer.write_attribute("", "format", "trihedron-campaign-runs");
  writer.write_attribute("", "version", "1");
  writer.write_attribute("", "title", plan.name);
  writer.write_attribute("", "source",
                         "trihedron campaign: simulated passes, calibrated and compared with their truth");
  writer.write_attribute("", "campaign_seed", std::to_string(plan.seed));
  writer.write_attribute("", "campaign_digest", std::string(digest));
  writer.write_attribute("", "sampling", plan.latin_hypercube ? "latin-hypercube" : "random");
  writer.write_variables(dimensions, variables);
  writer.commit();
}

}  // namespace trihedron::io
