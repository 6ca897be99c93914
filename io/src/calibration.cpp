#include "trihedron/io/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "json_node.hpp"
#include "text_file.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr const char* kFormat = "trihedron-calibration";
constexpr int kVersion = 1;

using Severity = Finding::Severity;
constexpr std::array kSeverities = {std::pair{Severity::kNote, "note"}, std::pair{Severity::kWarning, "warning"},
                                    std::pair{Severity::kDoNotUse, "do-not-use"}};

/// In the order of the model; empty for one that this program does not know.
std::vector<std::string_view> coefficients_of(const std::string& drift_model) {
  if (drift_model == Esg7::kModelName) {
    return {Esg7::kNames.begin(), Esg7::kNames.end()};
  }
  if (drift_model == Esg20::kModelName) {
    return {Esg20::kNames.begin(), Esg20::kNames.end()};
  }
  return {};
}

GyroCalibration parse_gyro(const JsonNode& node) {
  GyroCalibration gyro;
  gyro.drift_model = node.at("drift_model").text();
  const JsonNode drift = node.at("drift_rad_s");
  const std::vector<std::string_view> known = coefficients_of(gyro.drift_model);
  for (const auto& [name, value] : drift.members()) {
    if (known.empty()) {
      gyro.drift_rad_s.emplace_back(name, value.number());
    } else if (std::ranges::find(known, name) == known.end()) {
      drift.refuse(fmt::format("has coefficient {}, not one of {}", in_quotes(name), gyro.drift_model),
                   suggestion(name, known));
    }
  }
  for (const std::string_view name : known) {
    gyro.drift_rad_s.emplace_back(name, drift.at(std::string(name)).number());
  }
  gyro.alignment_rotation_vector_rad = node.at("alignment_rotation_vector_rad").vector3();
  gyro.momentum_in = node.at("momentum_in").vector3();
  if (!(std::abs(gyro.momentum_in.norm() - 1) <= 1e-6)) {
    node.at("momentum_in").refuse("is not a unit vector", "repair it: it is the direction of the angular momentum");
  }
  if (const auto bias = node.find("readout_bias")) {
    gyro.readout_bias = bias->vector3();
  }
  return gyro;
}

/// A state "gyroN.…" must name a gyro and be there once; other states may be added.
void check_states(const JsonNode& node, const Calibration& calibration) {
  const auto& states = calibration.states;
  for (auto state = states.begin(); state != states.end(); ++state) {
    if (std::find(states.begin(), state, *state) != state) {
      node.refuse(fmt::format("names {} twice", in_quotes(*state)), "each row of the matrix needs its own name");
    }
    constexpr std::string_view kPrefix = "gyro";
    if (state->starts_with(kPrefix)) {
      std::size_t number = 0;
      const auto [end, fault] = std::from_chars(state->data() + kPrefix.size(), state->data() + state->size(), number);
      if (fault != std::errc() || end == state->data() + state->size() || *end != '.' || number < 1 ||
          number > calibration.gyros.size()) {
        node.refuse(
            fmt::format("names {}, which is not of any of the {} gyros", in_quotes(*state), calibration.gyros.size()),
            "name states like \"gyro1.k0\" or \"gyro2.align_x\"");
      }
    }
  }
}

Eigen::MatrixXd parse_matrix(const JsonNode& node, std::size_t size) {
  const std::vector<JsonNode> rows = node.elements();
  const auto n = static_cast<Eigen::Index>(size);
  Eigen::MatrixXd matrix(n, n);
  if (rows.size() != size) {
    node.refuse(fmt::format("has {} rows for {} states", rows.size(), size), "give one row per state");
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::vector<double> row = rows[static_cast<std::size_t>(i)].numbers();
    if (row.size() != size) {
      rows[static_cast<std::size_t>(i)].refuse(fmt::format("has {} elements, the matrix {} rows", row.size(), size),
                                               "the matrix must be square");
    }
    matrix.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), n);
    if (!(matrix(i, i) >= 0)) {
      rows[static_cast<std::size_t>(i)].refuse("has a negative variance", "this is no covariance: calibrate again");
    }
  }
  // Rounding is far below this; a covariance that was edited or mixed up is not.
  constexpr double kSymmetry = 1e-9;
  const Eigen::VectorXd sigma = matrix.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      if (!(std::abs(matrix(i, j) - matrix(j, i)) <= kSymmetry * sigma(i) * sigma(j))) {
        node.refuse(fmt::format("is not symmetric at row {}, column {}", i + 1, j + 1),
                    "this is no covariance: calibrate again");
      }
    }
  }
  return matrix;
}

CalibrationNoise parse_noise(const JsonNode& node) {
  const auto not_negative = [&](const char* name) {
    const JsonNode value = node.at(name);
    if (!(value.number() >= 0)) {
      value.refuse(fmt::format("is {}", value.number()), "a noise is zero or more");
    }
    return value.number();
  };
  CalibrationNoise noise;
  noise.direction_random_walk_rad_sqrt_s = not_negative("direction_random_walk_rad_sqrt_s");
  noise.wandering_drift_rad_s = not_negative("wandering_drift_rad_s");
  noise.wandering_time_s = not_negative("wandering_time_s");
  if (!(noise.wandering_time_s < 1e9) || (noise.wandering_drift_rad_s > 0 && !(noise.wandering_time_s > 0))) {
    node.at("wandering_time_s")
        .refuse(fmt::format("is {}", noise.wandering_time_s), "give seconds, above 0 and below 1e9");
  }
  if (const auto star_tracker = node.find("star_tracker_noise_rad")) {
    noise.star_tracker_noise_rad = star_tracker->vector3();
    if (!(noise.star_tracker_noise_rad->array() > 0).all()) {
      star_tracker->refuse("is not positive", "give a 1-sigma about each axis");
    }
  }
  return noise;
}

Json noise_json(const CalibrationNoise& noise) {
  Json json = {{"direction_random_walk_rad_sqrt_s", noise.direction_random_walk_rad_sqrt_s},
               {"wandering_drift_rad_s", noise.wandering_drift_rad_s},
               {"wandering_time_s", noise.wandering_time_s}};
  if (noise.star_tracker_noise_rad) {
    json["star_tracker_noise_rad"] = to_json_array(*noise.star_tracker_noise_rad);
  }
  return json;
}

Finding parse_finding(const JsonNode& node) {
  Finding finding;
  finding.code = node.at("code").text();
  finding.text = node.at("text").text();
  if (const auto evidence = node.find("evidence")) {
    finding.evidence = evidence->text();
  }
  if (const auto cure = node.find("cure")) {
    finding.cure = cure->text();
  }
  if (const auto severity = node.find("severity")) {
    const std::string name = severity->text();
    const auto found = std::ranges::find(kSeverities, name, [](const auto& s) { return std::string_view(s.second); });
    if (found == kSeverities.end()) {
      severity->refuse(fmt::format("is {}", in_quotes(name)), "it must be note, warning or do-not-use");
    }
    finding.severity = found->first;
  }
  return finding;
}

Json finding_json(const Finding& finding) {
  const auto severity = std::ranges::find(kSeverities, finding.severity, [](const auto& s) { return s.first; });
  return {{"code", finding.code},
          {"text", finding.text},
          {"evidence", finding.evidence},
          {"cure", finding.cure},
          {"severity", severity->second}};
}

Json gyro_json(const GyroCalibration& gyro) {
  Json drift = Json::object();
  for (const auto& [name, value] : gyro.drift_rad_s) {
    drift[name] = value;
  }
  return {{"drift_model", gyro.drift_model},
          {"drift_rad_s", drift},
          {"alignment_rotation_vector_rad", to_json_array(gyro.alignment_rotation_vector_rad)},
          {"readout_bias", to_json_array(gyro.readout_bias)},
          {"momentum_in", to_json_array(gyro.momentum_in)}};
}

/// An array with each element on its own line, which is how a person looks at a matrix or a list of findings.
std::string lines(const Json& array) {
  std::string text;
  for (const Json& element : array) {
    text += fmt::format("{}\n   {}", text.empty() ? "" : ",", dump(element));
  }
  return "[" + text + "]";
}

}  // namespace

Calibration read_calibration(const std::filesystem::path& path) {
  const TextFile file(path);
  return parse_calibration(file.text(), path);
}

Calibration parse_calibration(std::string_view text, const std::filesystem::path& file) {
  const Json document = parse_json(text, file);
  const JsonNode root(document, file);
  if (const std::string format = root.at("format").text(); format != kFormat) {
    root.at("format").refuse(fmt::format("is {}", in_quotes(format)),
                             fmt::format("give a file with format \"{}\"", kFormat));
  }
  if (const double version = root.at("version").number(); version != kVersion) {
    root.at("version").refuse(fmt::format("is {}", version), fmt::format("this program reads version {}", kVersion));
  }
  Calibration calibration;
  calibration.estimator = root.at("estimator").text();
  const std::string epoch = root.at("epoch_tai").text();
  const std::optional<Time> parsed_epoch = parse_epoch(epoch);
  if (!parsed_epoch) {
    root.at("epoch_tai")
        .refuse(fmt::format("is {}, not an ISO date and time", in_quotes(epoch)),
                "write it like \"2009-05-20T00:00:00\"");
  }
  calibration.epoch = *parsed_epoch;
  const double t_s = root.at("t_s").number();
  if (!(std::abs(t_s) < 1e9)) {
    root.at("t_s").refuse(fmt::format("is {}", t_s), "give seconds since the epoch, below 1e9");
  }
  calibration.t = calibration.epoch + from_seconds(t_s);
  for (const JsonNode& gyro : root.at("gyros").elements()) {
    calibration.gyros.push_back(parse_gyro(gyro));
  }
  if (calibration.gyros.empty()) {
    root.at("gyros").refuse("is empty", "give one element per gyro");
  }
  const JsonNode covariance = root.at("covariance");
  for (const JsonNode& state : covariance.at("states").elements()) {
    calibration.states.push_back(state.text());
  }
  check_states(covariance.at("states"), calibration);
  calibration.covariance = parse_matrix(covariance.at("matrix"), calibration.states.size());
  const JsonNode verdict = root.at("verdict");
  calibration.verdict.trustworthy = verdict.at("trustworthy").boolean();
  for (const JsonNode& finding : verdict.at("findings").elements()) {
    calibration.verdict.findings.push_back(parse_finding(finding));
  }
  if (const auto further = root.find("further")) {
    for (const auto& [name, estimate] : further->members()) {
      calibration.further.push_back({name, estimate.at("value").number(), estimate.at("sigma").number()});
    }
  }
  if (const auto noise = root.find("noise")) {
    calibration.noise = parse_noise(*noise);
  }
  for (const auto& [name, value] : root.at("statistics").members()) {
    calibration.statistics[name] = value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.number();
  }
  return calibration;
}

std::string format_calibration(const Calibration& calibration) {
  Json gyros = Json::array();
  for (const GyroCalibration& gyro : calibration.gyros) {
    gyros.push_back(gyro_json(gyro));
  }
  Json matrix = Json::array();
  for (Eigen::Index i = 0; i < calibration.covariance.rows(); ++i) {
    const Eigen::RowVectorXd row = calibration.covariance.row(i);
    matrix.push_back(std::vector<double>(row.begin(), row.end()));
  }
  Json further = Json::object();
  for (const FurtherEstimate& estimate : calibration.further) {
    further[estimate.name] = {{"value", estimate.value}, {"sigma", estimate.sigma}};
  }
  const std::string noise =
      calibration.noise ? fmt::format(" \"noise\": {},\n", dump(noise_json(*calibration.noise))) : "";
  Json findings = Json::array();
  for (const Finding& finding : calibration.verdict.findings) {
    findings.push_back(finding_json(finding));
  }
  return fmt::format(
      "{{\"format\": \"{}\", \"version\": {},\n"
      " \"estimator\": {}, \"epoch_tai\": \"{}\", \"t_s\": {},\n"
      " \"gyros\": {},\n"
      " \"further\": {},\n{}"
      " \"covariance\": {{\n  \"states\": {},\n  \"matrix\": {}}},\n"
      " \"verdict\": {{\"trustworthy\": {}, \"findings\": {}}},\n"
      " \"statistics\": {}}}\n",
      kFormat, kVersion, dump(Json(calibration.estimator)), format_epoch(calibration.epoch),
      dump(Json(to_seconds(calibration.t - calibration.epoch))), lines(gyros), dump(further), noise,
      dump(Json(calibration.states)), lines(matrix), calibration.verdict.trustworthy, lines(findings),
      dump(Json(calibration.statistics)));
}

void write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  write_file(path, format_calibration(calibration));
}

}  // namespace trihedron::io
