#include "truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "json_schema.hpp"
#include "schemas.hpp"
#include "trihedron/core/drift.hpp"

namespace trihedron::io {
namespace {

constexpr int kTruthVersion = 1;
constexpr const char* kConvention =
    "v_c = Exp([lambda x]) v_b; q rotates c to in, Hamilton, scalar last; drift order k0 mu12 mu23 mu31 nu12 nu23 nu31";

std::vector<std::string> parse_names(const JsonNode& node, std::size_t size) {
  std::vector<std::string> names;
  for (const JsonNode& name : node.elements()) {
    names.push_back(name.text());
  }
  if (names.size() != size) {
    node.refuse(fmt::format("has {} names for {} values", names.size(), size), "give one name per value");
  }
  return names;
}

std::vector<double> parse_drift_of_eq1(const JsonNode& node) {
  std::vector<double> coefficients = node.numbers();
  if (coefficients.size() != Esg7::kSize) {
    node.refuse(fmt::format("has {} elements", coefficients.size()),
                "give seven numbers: k0 mu12 mu23 mu31 nu12 nu23 nu31");
  }
  return coefficients;
}

Member vector_member(std::string_view key, Eigen::Vector3d& target, std::string_view about) {
  return {key, about, three_of(number_schema()), [&target](const JsonNode& node) { target = node.vector3(); }};
}

Members gyro_members(Truth::Gyro& gyro, std::vector<double>& unmodelled, std::vector<std::string>& names) {
  Json seven = array_of(number_schema());
  seven["minItems"] = Esg7::kSize;
  seven["maxItems"] = Esg7::kSize;
  return {{"drift_rad_s", "k0 mu12 mu23 mu31 nu12 nu23 nu31", seven,
           [&](const JsonNode& node) {
             const std::vector<double> coefficients = parse_drift_of_eq1(node);
             for (std::size_t i = 0; i < coefficients.size(); ++i) {
               gyro.drift_rad_s.emplace_back(DriftCoefficient::of_eq1(static_cast<int>(i)), coefficients[i]);
             }
           }},
          vector_member("lambda_rad", gyro.alignment_rotation_vector_rad, "v_c = exp([this x]) v_b"),
          {"unmodelled_rad_s", "drift outside eq. (1)", array_of(number_schema()),
           [&](const JsonNode& node) { unmodelled = node.numbers(); }},
          optional_member({"unmodelled_names", "one per value", array_of(text_schema()),
                           [&](const JsonNode& node) { names = parse_names(node, unmodelled.size()); }})};
}

Truth::Gyro parse_truth_of_gyro(const JsonNode& node) {
  Truth::Gyro gyro;
  std::vector<double> unmodelled;
  std::vector<std::string> names;
  read_members(node, gyro_members(gyro, unmodelled, names));
  for (std::size_t i = 0; i < unmodelled.size(); ++i) {
    gyro.unmodelled_rad_s.emplace_back(names.empty() ? fmt::format("unmodelled{}", i + 1) : names[i], unmodelled[i]);
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

Members star_tracker_members(Truth::StarTracker& head) {
  return {
      {"clock_offset_s", "a fix stamped t gives the attitude at t + offset", number_schema(),
       [&head](const JsonNode& node) { head.clock_offset_s = node.number(); }},
      optional_member({"clock_rate_s_s", "by which that offset grows from the start of the pass on", number_schema(),
                       [&head](const JsonNode& node) { head.clock_rate_s_s = node.number(); }}),
      vector_member("orbital_sine_rad", head.orbital_sine_rad, "of the error at orbital period, axes of the head"),
      vector_member("orbital_cosine_rad", head.orbital_cosine_rad, "of the error at orbital period, axes of the head"),
      vector_member("misalignment_rad", head.misalignment_rad, "c axes")};
}

Json star_tracker_json(const Truth::StarTracker& head) {
  return {{"clock_offset_s", head.clock_offset_s},
          {"clock_rate_s_s", head.clock_rate_s_s},
          {"orbital_sine_rad", to_json_array(head.orbital_sine_rad)},
          {"orbital_cosine_rad", to_json_array(head.orbital_cosine_rad)},
          {"misalignment_rad", to_json_array(head.misalignment_rad)}};
}

Members truth_members(Truth& truth) {
  Truth::Gyro gyro;
  Truth::StarTracker head;
  std::vector<double> unmodelled;
  std::vector<std::string> names;
  return {optional_member(version_member(kTruthVersion)),
          optional_member({"convention", "", text_schema(), [](const JsonNode&) {}}),
          optional_member({"orbital_rate_rad_s", "of the mean argument of latitude", number_schema(),
                           [&truth](const JsonNode& node) { truth.orbital_rate_rad_s = node.number(); }}),
          {"gyros", "one element per gyro", array_of(schema_of(gyro_members(gyro, unmodelled, names))),
           [&truth](const JsonNode& node) {
             for (const JsonNode& element : node.elements()) {
               truth.gyros.push_back(parse_truth_of_gyro(element));
             }
           }},
          optional_member({"star_trackers", "one element per head", array_of(schema_of(star_tracker_members(head))),
                           [&truth](const JsonNode& node) {
                             for (const JsonNode& element : node.elements()) {
                               read_members(element, star_tracker_members(truth.star_trackers.emplace_back()));
                             }
                           }})};
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
      "{{\n \"version\": {},\n \"convention\": \"{}\",\n \"orbital_rate_rad_s\": {},\n \"gyros\": [{}\n ],\n "
      "\"star_trackers\": [{}\n "
      "]\n}}\n",
      kTruthVersion, kConvention, dump(Json(truth.orbital_rate_rad_s)), lines_of(gyros), lines_of(heads));
}

Json truth_schema() {
  Truth truth;
  return document_schema("Truth", "truth.json: what a simulator knows of the constants of a pass.",
                         schema_of(truth_members(truth)));
}

Truth make_truth(std::string_view json, const std::filesystem::path& json_file, const Series& series, Time epoch) {
  const Json document = parse_json(json, json_file);
  const JsonNode root(document, json_file);
  Truth truth;
  read_members(root, truth_members(truth));
  const std::size_t width = series.columns.size();
  if (const std::size_t in_table = (width - 4) / 3; truth.gyros.size() != in_table) {
    root.at("gyros").refuse(fmt::format("has {} elements, {} has {} gyros", truth.gyros.size(), series.name, in_table),
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
