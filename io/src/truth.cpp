#include "truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "json_node.hpp"
#include "trihedron/core/drift.hpp"

namespace trihedron::io {
namespace {

constexpr const char* kConvention =
    "v_c = Exp([lambda x]) v_b; q rotates c to in, Hamilton, scalar last; drift order k0 mu12 mu23 mu31 nu12 nu23 nu31";

/// The names of the drift outside eq. (1), where the file gives them; else numbers.
std::vector<std::string> unmodelled_names(const JsonNode& gyro, std::size_t size) {
  std::vector<std::string> names;
  if (const auto given = gyro.find("unmodelled_names")) {
    for (const JsonNode& name : given->elements()) {
      names.push_back(name.text());
    }
    if (names.size() != size) {
      given->refuse(fmt::format("has {} names for {} values", names.size(), size), "give one name per value");
    }
    return names;
  }
  for (std::size_t i = 1; i <= size; ++i) {
    names.push_back(fmt::format("unmodelled{}", i));
  }
  return names;
}

Truth::Gyro parse_truth_of_gyro(const JsonNode& node) {
  Truth::Gyro gyro;
  const JsonNode drift = node.at("drift_rad_s");
  const std::vector<double> coefficients = drift.numbers();
  if (coefficients.size() != Esg7::kSize) {
    drift.refuse(fmt::format("has {} elements", coefficients.size()),
                 "give seven numbers: k0 mu12 mu23 mu31 nu12 nu23 nu31");
  }
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    gyro.drift_rad_s.emplace_back(Esg7::kNames[i], coefficients[i]);
  }
  gyro.alignment_rotation_vector_rad = node.at("lambda_rad").vector3();
  const std::vector<double> unmodelled = node.at("unmodelled_rad_s").numbers();
  const std::vector<std::string> names = unmodelled_names(node, unmodelled.size());
  for (std::size_t i = 0; i < unmodelled.size(); ++i) {
    gyro.unmodelled_rad_s.emplace_back(names[i], unmodelled[i]);
  }
  return gyro;
}

Json gyro_json(const Truth::Gyro& gyro) {
  Json drift = Json::array();
  for (const char* name : Esg7::kNames) {
    const auto found = std::ranges::find(gyro.drift_rad_s, name, [](const auto& c) { return c.first; });
    drift.push_back(found == gyro.drift_rad_s.end() ? 0.0 : found->second);
  }
  Json names = Json::array();
  Json values = Json::array();
  for (const auto& [name, value] : gyro.unmodelled_rad_s) {
    names.push_back(name);
    values.push_back(value);
  }
  return {{"drift_rad_s", drift},
          {"lambda_rad", to_json_array(gyro.alignment_rotation_vector_rad)},
          {"unmodelled_names", names},
          {"unmodelled_rad_s", values}};
}

}  // namespace

std::string format_truth_parameters(const Truth& truth) {
  std::string gyros;
  for (const Truth::Gyro& gyro : truth.gyros) {
    gyros += fmt::format("{}\n  {}", gyros.empty() ? "" : ",", dump(gyro_json(gyro)));
  }
  return fmt::format("{{\n \"convention\": \"{}\",\n \"gyros\": [{}\n ]\n}}\n", kConvention, gyros);
}

Truth make_truth(std::string_view json, const std::filesystem::path& json_file, const Series& series, Time epoch) {
  const Json document = parse_json(json, json_file);
  const JsonNode gyros = JsonNode(document, json_file).at("gyros");
  Truth truth;
  for (const JsonNode& gyro : gyros.elements()) {
    truth.gyros.push_back(parse_truth_of_gyro(gyro));
  }
  const std::size_t width = series.columns.size();
  if (const std::size_t in_table = (width - 4) / 3; truth.gyros.size() != in_table) {
    gyros.refuse(fmt::format("has {} elements, {} has {} gyros", truth.gyros.size(), series.name, in_table),
                 "both must be of the same simulation");
  }
  const std::string cure = "the truth must be clean: simulate again";
  if (series.cut_line > 0) {
    throw InputRefused(series.file, {series.cut_line, 0}, "the last line is cut short", cure);
  }
  for (std::size_t i = 0; i < series.rows(); ++i) {
    const double* row = series.row(i);
    if (!(std::abs(series.t_s[i]) < 1e9) || !std::all_of(row, row + width, [](double v) { return std::isfinite(v); })) {
      throw InputRefused(series.file, series.position(i), "a value is missing or not finite", cure);
    }
    const Time t = epoch + from_seconds(series.t_s[i]);
    if (i > 0 && t <= truth.t.back()) {
      throw InputRefused(series.file, series.position(i), "the time stamp does not increase", cure);
    }
    truth.t.push_back(t);
    truth.q_in_c.emplace_back(row[3], row[0], row[1], row[2]);
    truth.h_in.insert(truth.h_in.end(), row + 4, row + width);
  }
  return truth;
}

}  // namespace trihedron::io
