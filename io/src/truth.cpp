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
    gyro.drift_rad_s.emplace_back(DriftCoefficient::of_eq1(static_cast<int>(i)), coefficients[i]);
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
  for (int i = 0; i < Esg7::kSize; ++i) {
    drift.push_back(gyro.drift(DriftCoefficient::of_eq1(i)).value_or(0.0));
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

Truth::StarTracker parse_truth_of_star_tracker(const JsonNode& node) {
  return {node.at("clock_offset_s").number(), node.at("orbital_sine_rad").vector3(),
          node.at("orbital_cosine_rad").vector3(), node.at("misalignment_rad").vector3()};
}

Json star_tracker_json(const Truth::StarTracker& head) {
  return {{"clock_offset_s", head.clock_offset_s},
          {"orbital_sine_rad", to_json_array(head.orbital_sine_rad)},
          {"orbital_cosine_rad", to_json_array(head.orbital_cosine_rad)},
          {"misalignment_rad", to_json_array(head.misalignment_rad)}};
}

/// The items of a JSON array, one per line.
std::string lines_of(const std::vector<Json>& items) {
  std::string lines;
  for (const Json& item : items) {
    lines += fmt::format("{}\n  {}", lines.empty() ? "" : ",", dump(item));
  }
  return lines;
}

}  // namespace

std::string format_truth_parameters(const Truth& truth) {
  std::vector<Json> gyros;
  for (const Truth::Gyro& gyro : truth.gyros) {
    gyros.push_back(gyro_json(gyro));
  }
  std::vector<Json> heads;
  for (const Truth::StarTracker& head : truth.star_trackers) {
    heads.push_back(star_tracker_json(head));
  }
  return fmt::format(
      "{{\n \"convention\": \"{}\",\n \"orbital_rate_rad_s\": {},\n \"gyros\": [{}\n ],\n \"star_trackers\": [{}\n "
      "]\n}}\n",
      kConvention, dump(Json(truth.orbital_rate_rad_s)), lines_of(gyros), lines_of(heads));
}

Truth make_truth(std::string_view json, const std::filesystem::path& json_file, const Series& series, Time epoch) {
  const Json document = parse_json(json, json_file);
  const JsonNode root(document, json_file);
  const JsonNode gyros = root.at("gyros");
  Truth truth;
  for (const JsonNode& gyro : gyros.elements()) {
    truth.gyros.push_back(parse_truth_of_gyro(gyro));
  }
  if (const auto rate = root.find("orbital_rate_rad_s")) {
    truth.orbital_rate_rad_s = rate->number();
  }
  if (const auto heads = root.find("star_trackers")) {
    for (const JsonNode& head : heads->elements()) {
      truth.star_trackers.push_back(parse_truth_of_star_tracker(head));
    }
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
