#include "trihedron/io/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "json_node.hpp"
#include "text_file.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr const char* kFormat = "trihedron-calibration";
constexpr int kVersion = 1;

DriftModelId parse_drift_model(const JsonNode& node) {
  const std::string name = node.text();
  const std::optional<DriftModelId> model = drift_model_named(name);
  if (!model) {
    node.refuse(fmt::format("is {}, no drift model", in_quotes(name)), fmt::format("give {}", drift_model_choices()));
  }
  return *model;
}

Estimator parse_estimator(const JsonNode& node) {
  const std::string name = node.text();
  const std::optional<Estimator> estimator = estimator_named(name);
  if (!estimator) {
    node.refuse(fmt::format("is {}, no estimator", in_quotes(name)),
                fmt::format("give one of: {}", estimator_choices()));
  }
  return *estimator;
}

GyroCalibration parse_gyro(const JsonNode& node) {
  GyroCalibration gyro;
  gyro.drift_model = parse_drift_model(node.at("drift_model"));
  const JsonNode drift = node.at("drift_rad_s");
  const std::vector<std::string> names = coefficient_names(gyro.drift_model);
  const std::vector<std::string_view> known(names.begin(), names.end());
  for (const auto& [name, value] : drift.members()) {
    if (std::ranges::find(known, name) == known.end()) {
      drift.refuse(fmt::format("has coefficient {}, not one of {}", in_quotes(name), name_of(gyro.drift_model)),
                   suggestion(name, known));
    }
  }
  for (const std::string& name : names) {
    gyro.drift_rad_s.push_back(drift.at(name).number(limits::kDrift_rad_s));
  }
  gyro.alignment_rotation_vector_rad = node.at("alignment_rotation_vector_rad").vector3(limits::kRotation_rad);
  gyro.momentum_in = node.at("momentum_in").vector3();
  if (!(std::abs(gyro.momentum_in.norm() - 1) <= 1e-6)) {
    node.at("momentum_in").refuse("is not a unit vector", "repair it: it is the direction of the angular momentum");
  }
  if (const auto bias = node.find("readout_bias")) {
    gyro.readout_bias = bias->vector3(limits::kReadoutBias);
  }
  return gyro;
}

/// A state "gyroN.…" must name a gyro and be there once; other states may be added.
void check_states(const JsonNode& node, const std::vector<std::string>& states, std::size_t gyros) {
  for (auto state = states.begin(); state != states.end(); ++state) {
    if (std::find(states.begin(), state, *state) != state) {
      node.refuse(fmt::format("names {} twice", in_quotes(*state)), "each row of the matrix needs its own name");
    }
    constexpr std::string_view kPrefix = "gyro";
    if (state->starts_with(kPrefix)) {
      std::size_t number = 0;
      const auto [end, fault] = std::from_chars(state->data() + kPrefix.size(), state->data() + state->size(), number);
      if (fault != std::errc() || end == state->data() + state->size() || *end != '.' || number < 1 || number > gyros) {
        node.refuse(fmt::format("names {}, which is not of any of the {} gyros", in_quotes(*state), gyros),
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

const Range& range_of_sigma(const ParameterId& state) {
  return state.is_drift()       ? limits::kDriftSigma_rad_s
         : state.is_alignment() ? limits::kAlignmentSigma_rad
                                : limits::kFurtherStateSigma;
}

/// States and covariance. States that this program does not know are left out: what is left is still the covariance of
/// the others.
void parse_covariance(const JsonNode& node, Calibration& calibration) {
  std::vector<std::string> names;
  for (const JsonNode& state : node.at("states").elements()) {
    names.push_back(state.text());
  }
  check_states(node.at("states"), names, calibration.gyros.size());
  const Eigen::MatrixXd matrix = parse_matrix(node.at("matrix"), names.size());
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const std::optional<ParameterId> state = parameter_named(names[i])) {
      calibration.states.push_back(*state);
      rows.push_back(static_cast<Eigen::Index>(i));
    }
  }
  calibration.covariance = matrix(rows, rows);
  for (Eigen::Index i = 0; i < calibration.covariance.rows(); ++i) {
    const Range& range = range_of_sigma(calibration.states[static_cast<std::size_t>(i)]);
    const double sigma = std::sqrt(calibration.covariance(i, i));
    if (!(sigma <= range.most)) {
      node.at("matrix").refuse(
          fmt::format("has the variance of a sigma of {} that {}",
                      name_of(calibration.states[static_cast<std::size_t>(i)]), is_outside(sigma, range)),
          std::string(range.why));
    }
  }
}

/// A value that is zero where there is no such noise.
double zero_or(const Range& range, const JsonNode& node) {
  Range wider = range;
  wider.zero_allowed = true;
  return node.number(wider);
}

CalibrationNoise parse_noise(const JsonNode& node) {
  CalibrationNoise noise;
  noise.direction_random_walk_rad_sqrt_s =
      node.at("direction_random_walk_rad_sqrt_s").number(limits::kRandomWalk_rad_sqrt_s);
  noise.wandering_drift_rad_s = zero_or(limits::kWanderingDrift_rad_s, node.at("wandering_drift_rad_s"));
  noise.wandering_time_s = noise.wandering_drift_rad_s > 0
                               ? node.at("wandering_time_s").number(limits::kWanderingTime_s)
                               : zero_or(limits::kWanderingTime_s, node.at("wandering_time_s"));
  if (const auto star_tracker = node.find("star_tracker_noise_rad")) {
    noise.star_tracker_noise_rad = star_tracker->vector3(limits::kStarTrackerNoise_rad);
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
  finding.code = finding_code_named(node.at("code").text());
  finding.text = node.at("text").text();
  if (const auto evidence = node.find("evidence")) {
    finding.evidence = evidence->text();
  }
  if (const auto cure = node.find("cure")) {
    finding.cure = cure->text();
  }
  finding.severity = FindingSeverity::kWarning;
  if (const auto severity = node.find("severity")) {
    const std::string name = severity->text();
    const auto* const found = std::ranges::find(kFindingSeverities, name, &FindingSeverityRow::name);
    if (found == kFindingSeverities.end()) {
      severity->refuse(fmt::format("is {}", in_quotes(name)), "it must be note, warning or do-not-use");
    }
    finding.severity = found->severity;
  }
  return finding;
}

Json finding_json(const Finding& finding) {
  const auto* const severity = std::ranges::find(kFindingSeverities, finding.severity, &FindingSeverityRow::severity);
  return {{"code", name_of(finding.code)},
          {"text", finding.text},
          {"evidence", finding.evidence},
          {"cure", finding.cure},
          {"severity", severity->name}};
}

Json gyro_json(const GyroCalibration& gyro) {
  Json drift = Json::object();
  const std::vector<std::string> names = coefficient_names(gyro.drift_model);
  for (std::size_t i = 0; i < gyro.drift_rad_s.size(); ++i) {
    drift[names.at(i)] = gyro.drift_rad_s[i];
  }
  return {{"drift_model", name_of(gyro.drift_model)},
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
  calibration.estimator = parse_estimator(root.at("estimator"));
  const std::string epoch = root.at("epoch_tai").text();
  const std::optional<Time> parsed_epoch = parse_epoch(epoch);
  if (!parsed_epoch) {
    root.at("epoch_tai")
        .refuse(fmt::format("is {}, not an ISO date and time", in_quotes(epoch)),
                "write it like \"2009-05-20T00:00:00\"");
  }
  calibration.epoch = *parsed_epoch;
  const double t_s = root.at("t_s").number(limits::kTimeOfCalibration_s);
  calibration.t = calibration.epoch + from_seconds(t_s);
  for (const JsonNode& gyro : root.at("gyros").elements()) {
    calibration.gyros.push_back(parse_gyro(gyro));
  }
  if (calibration.gyros.empty()) {
    root.at("gyros").refuse("is empty", "give one element per gyro");
  }
  parse_covariance(root.at("covariance"), calibration);
  const JsonNode verdict = root.at("verdict");
  calibration.verdict.trustworthy = verdict.at("trustworthy").boolean();
  for (const JsonNode& finding : verdict.at("findings").elements()) {
    calibration.verdict.findings.push_back(parse_finding(finding));
  }
  if (const auto further = root.find("further")) {
    for (const auto& [name, estimate] : further->members()) {
      const double value = estimate.at("value").number(limits::kFurtherState);
      const double sigma = estimate.at("sigma").number(limits::kFurtherStateSigma);
      if (const std::optional<ParameterId> parameter = parameter_named(name)) {
        calibration.further.push_back({*parameter, value, sigma});
      }
    }
  }
  if (const auto noise = root.find("noise")) {
    calibration.noise = parse_noise(*noise);
  }
  for (const auto& [name, value] : root.at("statistics").members()) {
    set_value(calibration.statistics, name,
              value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.number());
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
    further[name_of(estimate.parameter)] = {{"value", estimate.value}, {"sigma", estimate.sigma}};
  }
  Json states = Json::array();
  for (const ParameterId& state : calibration.states) {
    states.push_back(name_of(state));
  }
  Json statistics = Json::object();
  for (const auto& [name, value] : named_values(calibration.statistics)) {
    statistics[name] = value;
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
      kFormat, kVersion, dump(Json(name_of(calibration.estimator))), format_epoch(calibration.epoch),
      dump(Json(to_seconds(calibration.t - calibration.epoch))), lines(gyros), dump(further), noise, dump(states),
      lines(matrix), calibration.verdict.trustworthy, lines(findings), dump(statistics));
}

void write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  write_file(path, format_calibration(calibration));
}

}  // namespace trihedron::io
