#include "trihedron/io/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "json_schema.hpp"
#include "schemas.hpp"
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

void read_drift(const JsonNode& drift, GyroCalibration& gyro) {
  const std::vector<std::string> names = coefficient_names(gyro.drift_model);
  const std::vector<std::string_view> known(names.begin(), names.end());
  for (const auto& [name, value] : drift.members()) {
    if (name == "W(4,4)") {
      drift.refuse("has W(4,4) of an earlier version",
                   "calibrate again: k0 and W(4,4) had a part in common, now W(4,4-k0) has none in k0");
    }
    if (std::ranges::find(known, name) == known.end()) {
      drift.refuse(fmt::format("has coefficient {}, not one of {}", in_quotes(name), name_of(gyro.drift_model)),
                   suggestion(name, known));
    }
  }
  for (const std::string& name : names) {
    gyro.drift_rad_s.push_back(drift.at(name).number(limits::kDrift_rad_s));
  }
}

Eigen::Vector3d parse_momentum(const JsonNode& node) {
  const Eigen::Vector3d momentum = node.vector3();
  if (!(std::abs(momentum.norm() - 1) <= 1e-6)) {
    node.refuse("is not a unit vector", "repair it: it is the direction of the angular momentum");
  }
  return momentum;
}

Member vector_member(std::string_view key, Eigen::Vector3d& target, const Range& range, std::string_view about) {
  return {key, about, three_of(number_schema(range)),
          [&target, range](const JsonNode& node) { target = node.vector3(range); }};
}

Members orbital_drift_members(OrbitalDrift& drift) {
  return {vector_member("sine_rad_s", drift.sine_rad_s, limits::kDrift_rad_s, "about the case axes"),
          vector_member("cosine_rad_s", drift.cosine_rad_s, limits::kDrift_rad_s, "about the case axes"),
          {"rate_rad_s", "of the phase, which is 0 at the epoch", number_schema(limits::kOrbitalRate_rad_s),
           [&drift](const JsonNode& node) { drift.rate_rad_s = node.number(limits::kOrbitalRate_rad_s); }}};
}

using OfEq1 = Esg7::Coefficients<double>;

Member eq1_member(std::string_view key, OfEq1& target) {
  return {key, "by coefficient of eq. (1)", object_of({}, number_schema(limits::kDrift_rad_s)),
          [&target](const JsonNode& node) {
            for (int i = 0; i < Esg7::kSize; ++i) {
              target(i) = node.at(name_of(DriftCoefficient::of_eq1(i))).number(limits::kDrift_rad_s);
            }
          }};
}

/// A number that is kept as float.
Member float_member(std::string_view key, float& target, const Range& range, std::string_view about) {
  return {key, about, number_schema(range),
          [&target, range](const JsonNode& node) { target = static_cast<float>(node.number(range)); }};
}

Members polhode_members(PolhodeDrift& drift) {
  return {
      float_member("period_s", drift.polhode.period_s, limits::kPolhodePeriod_s, "at the epoch, where its angle is 0"),
      float_member("period_rate", drift.polhode.period_rate, limits::kPolhodePeriodRate, "seconds per second"),
      eq1_member("sine_rad_s", drift.sine_rad_s), eq1_member("cosine_rad_s", drift.cosine_rad_s)};
}

Members gyro_members(GyroCalibration& gyro) {
  OrbitalDrift orbital;
  PolhodeDrift polhode;
  return {
      {"drift_model", "of eq. (1) or beyond it", drift_model_schema(),
       [&gyro](const JsonNode& node) { gyro.drift_model = parse_drift_model(node); }},
      {"drift_rad_s", "by coefficient of the model", object_of({}, number_schema(limits::kDrift_rad_s)),
       [&gyro](const JsonNode& node) { read_drift(node, gyro); }},
      vector_member("alignment_rotation_vector_rad", gyro.alignment_rotation_vector_rad, limits::kRotation_rad,
                    "v_c = exp([this x]) v_b"),
      optional_member(
          vector_member("readout_bias", gyro.readout_bias, limits::kReadoutBias, "of the direction cosines")),
      optional_member(
          {"orbital_drift", "drift that comes back with each orbit", schema_of(orbital_drift_members(orbital)),
           [&gyro](const JsonNode& node) { read_members(node, orbital_drift_members(gyro.orbital_drift.emplace())); }}),
      optional_member({"polhode", "coefficients that come and go with the polhode of the rotor",
                       schema_of(polhode_members(polhode)),
                       [&gyro](const JsonNode& node) { read_members(node, polhode_members(gyro.polhode.emplace())); }}),
      {"momentum_in", "its direction at t_s, a unit vector", three_of(number_schema()),
       [&gyro](const JsonNode& node) { gyro.momentum_in = parse_momentum(node); }}};
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

/// Names, among the states of the covariance, of the amplitudes of drift that comes back, of all gyros that have it.
std::vector<std::string> amplitudes_of(const Calibration& calibration) {
  std::vector<std::string> amplitudes;
  const auto add = [&](std::size_t k, bool is_there, std::span<const std::string_view> components) {
    for (const std::string_view component : components) {
      if (is_there) {
        amplitudes.push_back(fmt::format("gyro{}.{}", k + 1, component));
      }
    }
  };
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    add(k, calibration.gyros[k].orbital_drift.has_value(), further_state_components::kOrbitalDrift);
  }
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    add(k, calibration.gyros[k].polhode.has_value(), further_state_components::kPolhode);
  }
  return amplitudes;
}

const Range& range_of_sigma(const ParameterId& state) {
  return state.is_drift()       ? limits::kDriftSigma_rad_s
         : state.is_alignment() ? limits::kAlignmentSigma_rad
                                : limits::kFurtherStateSigma;
}

/// States and covariance. States that this program does not know are left out: what is left is still the covariance of
/// the others.
void read_matrix(const JsonNode& node, const std::vector<std::string>& names, Calibration& calibration) {
  const Eigen::MatrixXd matrix = parse_matrix(node, names.size());
  std::vector<Eigen::Index> rows;
  std::vector<Eigen::Index> amplitudes;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::optional<ParameterId> state = parameter_named(names[i]);
    if (state) {
      calibration.states.push_back(*state);
      rows.push_back(static_cast<Eigen::Index>(i));
    }
  }
  std::string missing;
  for (const std::string& amplitude : amplitudes_of(calibration)) {
    const auto row = std::ranges::find(names, amplitude) - names.begin();
    if (row < std::ssize(names)) {
      amplitudes.push_back(row);
    } else {
      missing = amplitude;
    }
  }
  if (!amplitudes.empty() && !missing.empty()) {
    node.refuse(fmt::format("has no row of {}", in_quotes(missing)), "this is no whole covariance: calibrate again");
  }
  calibration.covariance = matrix(rows, rows);
  calibration.amplitude_covariance.resize(std::ssize(amplitudes),
                                          amplitudes.empty() ? 0 : std::ssize(rows) + std::ssize(amplitudes));
  if (!amplitudes.empty()) {
    calibration.amplitude_covariance << matrix(amplitudes, rows), matrix(amplitudes, amplitudes);
  }
  for (Eigen::Index i = 0; i < calibration.covariance.rows(); ++i) {
    const Range& range = range_of_sigma(calibration.states[static_cast<std::size_t>(i)]);
    const double sigma = std::sqrt(calibration.covariance(i, i));
    if (!(sigma <= range.most)) {
      node.refuse(fmt::format("has the variance of a sigma of {} that {}",
                              name_of(calibration.states[static_cast<std::size_t>(i)]), is_outside(sigma, range)),
                  std::string(range.why));
    }
  }
}

Members covariance_members(Calibration& calibration, std::vector<std::string>& names) {
  return {{"states", "names of the rows: gyro1.k0, gyro1.align_x, ...", array_of(text_schema()),
           [&](const JsonNode& node) {
             for (const JsonNode& state : node.elements()) {
               names.push_back(state.text());
             }
             check_states(node, names, calibration.gyros.size());
           }},
          {"matrix", "in the units of the states, squared", array_of(array_of(number_schema())),
           [&](const JsonNode& node) { read_matrix(node, names, calibration); }}};
}

Member number_member(std::string_view key, double& target, const Range& range, std::string_view about) {
  return {key, about, number_schema(range), [&target, range](const JsonNode& node) { target = node.number(range); }};
}

Member flag_member(std::string_view key, bool& target, std::string_view about) {
  return {key, about, {{"type", "boolean"}}, [&target](const JsonNode& node) { target = node.boolean(); }};
}

/// Zero as well: there is no such noise.
Range zero_or(Range range) {
  range.zero_allowed = true;
  return range;
}

Members noise_members(CalibrationNoise& noise) {
  const Range time = zero_or(limits::kWanderingTime_s);
  return {number_member("direction_random_walk_rad_sqrt_s", noise.direction_random_walk_rad_sqrt_s,
                        limits::kRandomWalk_rad_sqrt_s, "of each momentum, per axis across it"),
          number_member("wandering_drift_rad_s", noise.wandering_drift_rad_s, zero_or(limits::kWanderingDrift_rad_s),
                        "1-sigma; 0: there is none"),
          {"wandering_time_s", "its correlation time, 0 where there is none", number_schema(time),
           [&noise, time](const JsonNode& node) {
             noise.wandering_time_s = node.number(noise.wandering_drift_rad_s > 0 ? limits::kWanderingTime_s : time);
           }},
          optional_member({"star_tracker_noise_rad", "1-sigma about c x, y, z, where it was found from the pass",
                           three_of(number_schema(limits::kStarTrackerNoise_rad)), [&noise](const JsonNode& node) {
                             noise.star_tracker_noise_rad = node.vector3(limits::kStarTrackerNoise_rad);
                           }})};
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

FindingSeverity parse_severity(const JsonNode& node) {
  const std::string name = node.text();
  const auto* const found = std::ranges::find(kFindingSeverities, name, &FindingSeverityRow::name);
  if (found == kFindingSeverities.end()) {
    node.refuse(fmt::format("is {}", in_quotes(name)), "it must be note, warning or do-not-use");
  }
  return found->severity;
}

Json severity_schema() {
  std::vector<std::string_view> names;
  for (const FindingSeverityRow& row : kFindingSeverities) {
    names.push_back(row.name);
  }
  return one_of(names);
}

Members finding_members(Finding& finding) {
  const auto text = [](std::string_view key, std::string& target, std::string_view about) -> Member {
    return {key, about, text_schema(), [&target](const JsonNode& node) { target = node.text(); }};
  };
  return {{"code", "its name for programs", text_schema(),
           [&finding](const JsonNode& node) { finding.code = finding_code_named(node.text()); }},
          text("text", finding.text, "what was found"),
          optional_member(text("evidence", finding.evidence, "in numbers")),
          optional_member(text("cure", finding.cure, "what to do")),
          optional_member({"severity", "warning where it is left out", severity_schema(),
                           [&finding](const JsonNode& node) { finding.severity = parse_severity(node); }})};
}

Finding parse_finding(const JsonNode& node) {
  Finding finding;
  finding.severity = FindingSeverity::kWarning;
  read_members(node, finding_members(finding));
  return finding;
}

Json finding_json(const Finding& finding) {
  return {{"code", name_of(finding.code)},
          {"text", finding.text},
          {"evidence", finding.evidence},
          {"cure", finding.cure},
          {"severity", name_of(finding.severity)}};
}

Json gyro_json(const GyroCalibration& gyro, Time epoch) {
  Json drift = Json::object();
  const std::vector<std::string> names = coefficient_names(gyro.drift_model);
  for (std::size_t i = 0; i < gyro.drift_rad_s.size(); ++i) {
    drift[names.at(i)] = gyro.drift_rad_s[i];
  }
  Json json = {{"drift_model", name_of(gyro.drift_model)},
               {"drift_rad_s", drift},
               {"alignment_rotation_vector_rad", to_json_array(gyro.alignment_rotation_vector_rad)},
               {"readout_bias", to_json_array(gyro.readout_bias)},
               {"momentum_in", to_json_array(gyro.momentum_in)}};
  if (gyro.orbital_drift) {
    const OrbitalDrift orbital = gyro.orbital_drift->from(epoch);
    json["orbital_drift"] = {{"sine_rad_s", to_json_array(orbital.sine_rad_s)},
                             {"cosine_rad_s", to_json_array(orbital.cosine_rad_s)},
                             {"rate_rad_s", orbital.rate_rad_s}};
  }
  if (gyro.polhode) {
    const PolhodeDrift its = gyro.polhode->from(epoch);
    const auto by_name = [](const OfEq1& coefficients) {
      Json all = Json::object();
      for (int i = 0; i < Esg7::kSize; ++i) {
        all[name_of(DriftCoefficient::of_eq1(i))] = coefficients(i);
      }
      return all;
    };
    json["polhode"] = {{"period_s", its.polhode.period_s},
                       {"period_rate", its.polhode.period_rate},
                       {"sine_rad_s", by_name(its.sine_rad_s)},
                       {"cosine_rad_s", by_name(its.cosine_rad_s)}};
  }
  return json;
}

constexpr std::array<std::string_view, 2> kPotentials = {"W", "D"};

Members level_members(DriftFieldLevel& level, std::size_t gyros) {
  return {
      {"gyro", "1 …", whole_schema(1, kMaxGyros),
       [&level, gyros](const JsonNode& node) {
         level.gyro = static_cast<int>(node.number({1, static_cast<double>(gyros), "", "it is one of the gyros"})) - 1;
       }},
      {"potential", "W: -grad W, D: h x grad D", one_of(kPotentials),
       [&level](const JsonNode& node) {
         const std::string name = node.text();
         if (std::ranges::find(kPotentials, name) == kPotentials.end()) {
           node.refuse(fmt::format("is {}, no potential", in_quotes(name)), "give W or D");
         }
         level.potential = name == kPotentials[0] ? DriftCoefficient::Member::kW : DriftCoefficient::Member::kD;
       }},
      {"degree", "", whole_schema(1, DriftModelId::kMaxDegree),
       [&level](const JsonNode& node) {
         level.degree =
             static_cast<int>(node.number({1, DriftModelId::kMaxDegree, "", "it is a degree of the drift field"}));
       }},
      number_member("rms_rad_s", level.rms_rad_s, limits::kDriftField_rad_s, "over the sphere, most likely"),
      number_member("sigma_factor", level.sigma_factor, limits::kSigmaFactor,
                    "its 1-sigma: from rms / factor to rms * factor")};
}

Members on_board_members(OnBoardDrift& drift) {
  return {{"drift_model", "it has room for", drift_model_schema(),
           [&drift](const JsonNode& node) {
             drift.drift_model = parse_drift_model(node);
             if (drift.drift_model.degree > DriftModelId::kMaxDegreeOnBoard) {
               node.refuse(fmt::format("is {}", in_quotes(name_of(drift.drift_model))),
                           fmt::format("there is room for degree {} and less", DriftModelId::kMaxDegreeOnBoard));
             }
           }},
          number_member("random_walk_rad_sqrt_s", drift.random_walk_rad_sqrt_s, limits::kRandomWalk_rad_sqrt_s,
                        "of each momentum, per axis across it, for what it leaves out")};
}

Json level_json(const DriftFieldLevel& level) {
  return {{"gyro", level.gyro + 1},
          {"potential", kPotentials[level.potential == DriftCoefficient::Member::kW ? 0 : 1]},
          {"degree", level.degree},
          {"rms_rad_s", level.rms_rad_s},
          {"sigma_factor", level.sigma_factor}};
}

Member time_member(std::string_view key, Duration& target, std::string_view about) {
  return {key, about, number_schema(limits::kForecastTime_s),
          [&target](const JsonNode& node) { target = from_seconds(node.number(limits::kForecastTime_s)); }};
}

Members accuracy_members(AccuracyForecast& accuracy) {
  return {number_member("limit_rad", accuracy.limit_rad, limits::kNeededError_rad, "total attitude error, 99.7 %"),
          time_member("time_s", accuracy.within, "after the correction, until it is first passed"),
          flag_member("is_lower_bound", accuracy.is_lower_bound, "it was not passed until the end of the forecast")};
}

Json accuracy_json(const AccuracyForecast& accuracy) {
  return {{"limit_rad", accuracy.limit_rad},
          {"time_s", to_seconds(accuracy.within)},
          {"is_lower_bound", accuracy.is_lower_bound}};
}

Members cause_members(ErrorCause& cause) {
  return {{"name", "of a state, or what else it is", text_schema(),
           [&cause](const JsonNode& node) {
             cause.name = node.text();
             cause.is_parameter = parameter_named(cause.name).has_value();
           }},
          number_member("share", cause.share, limits::kShare,
                        "of the mean square error that would not be there if it were known; they overlap")};
}

Members need_members(NeedForecast& need) {
  ErrorCause cause;
  return {number_member("error_rad", need.need.error_rad, limits::kNeededError_rad, "that may not be exceeded, 99.7 %"),
          time_member("interval_s", need.need.interval, "for so long after the correction"),
          flag_member("met", need.met, ""),
          optional_member(number_member("error_997_rad", need.error_997_rad, limits::kForecastError_rad,
                                        "predicted; missing where there is no attitude")),
          {"within", "how long it is kept", schema_of(accuracy_members(need.accuracy)),
           [&need](const JsonNode& node) { read_members(node, accuracy_members(need.accuracy)); }},
          {"causes", "of the error at the end of the interval, largest first",
           array_of(schema_of(cause_members(cause))), [&need](const JsonNode& node) {
             for (const JsonNode& element : node.elements()) {
               read_members(element, cause_members(need.causes.emplace_back()));
             }
           }}};
}

Json need_json(const NeedForecast& need) {
  Json json = {{"error_rad", need.need.error_rad}, {"interval_s", to_seconds(need.need.interval)}, {"met", need.met}};
  if (std::isfinite(need.error_997_rad)) {
    json["error_997_rad"] = need.error_997_rad;
  }
  json["within"] = accuracy_json(need.accuracy);
  json["causes"] = Json::array();
  for (const ErrorCause& cause : need.causes) {
    json["causes"].push_back({{"name", cause.name}, {"share", cause.share}});
  }
  return json;
}

/// A series of the forecast: where a value of it is in an error.
struct ForecastSeries {
  std::string_view key;
  std::string_view about;
  double (*get)(const PredictedError&);
  void (*set)(PredictedError&, double);
};

constexpr std::array<ForecastSeries, 7> kForecastSeries = {{
    {"after_s", "since the correction", [](const PredictedError& e) { return to_seconds(e.after); },
     [](PredictedError& e, double value) { e.after = from_seconds(value); }},
    {"sigma_roll_rad", "1-sigma about c x", [](const PredictedError& e) { return std::sqrt(e.covariance_rad2(0, 0)); },
     [](PredictedError& e, double value) { e.covariance_rad2(0, 0) = value * value; }},
    {"sigma_pitch_rad", "about c y", [](const PredictedError& e) { return std::sqrt(e.covariance_rad2(1, 1)); },
     [](PredictedError& e, double value) { e.covariance_rad2(1, 1) = value * value; }},
    {"sigma_heading_rad", "about c z", [](const PredictedError& e) { return std::sqrt(e.covariance_rad2(2, 2)); },
     [](PredictedError& e, double value) { e.covariance_rad2(2, 2) = value * value; }},
    {"error_68_rad", "that the total error is below in 68 % of the cases",
     [](const PredictedError& e) { return e.error_68_rad; },
     [](PredictedError& e, double value) { e.error_68_rad = value; }},
    {"error_95_rad", "95 %", [](const PredictedError& e) { return e.error_95_rad; },
     [](PredictedError& e, double value) { e.error_95_rad = value; }},
    {"error_997_rad", "99.7 %", [](const PredictedError& e) { return e.error_997_rad; },
     [](PredictedError& e, double value) { e.error_997_rad = value; }},
}};

void read_series(const JsonNode& node, const ForecastSeries& series, std::vector<PredictedError>& errors) {
  const Range& range = series.key == kForecastSeries[0].key ? limits::kForecastTime_s : limits::kForecastError_rad;
  const std::vector<JsonNode> values = node.elements();
  if (series.key == kForecastSeries[0].key) {
    errors.resize(values.size());
  }
  if (values.size() != errors.size()) {
    node.refuse(fmt::format("has {} values for {} times", values.size(), errors.size()), "give one for each time");
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.set(errors[i], values[i].number(range));
  }
}

Members forecast_members(OpenLoopForecast& forecast) {
  NeedForecast need;
  Members members = {
      {"within", "how long the usual limit is kept", schema_of(accuracy_members(forecast.usual)),
       [&forecast](const JsonNode& node) { read_members(node, accuracy_members(forecast.usual)); }},
      optional_member({"need", "where one is stated", schema_of(need_members(need)), [&forecast](const JsonNode& node) {
                         read_members(node, need_members(forecast.need.emplace()));
                       }})};
  for (const ForecastSeries& series : kForecastSeries) {
    members.push_back({series.key, series.about,
                       array_of(number_schema(series.key == kForecastSeries[0].key ? limits::kForecastTime_s
                                                                                   : limits::kForecastError_rad)),
                       [&forecast, &series](const JsonNode& node) { read_series(node, series, forecast.errors); }});
  }
  return members;
}

/// Up to where there is no attitude any more.
Json forecast_json(const OpenLoopForecast& forecast) {
  Json json = {{"within", accuracy_json(forecast.usual)}};
  if (forecast.need) {
    json["need"] = need_json(*forecast.need);
  }
  for (const ForecastSeries& series : kForecastSeries) {
    Json& values = json[std::string(series.key)] = Json::array();
    for (const PredictedError& error : forecast.errors) {
      if (!std::isfinite(error.error_997_rad)) {
        break;
      }
      values.push_back(series.get(error));
    }
  }
  return json;
}

void read_latencies(const JsonNode& node, std::size_t gyros, ClockCorrection& clocks) {
  const std::vector<JsonNode> values = node.elements();
  if (values.size() != gyros) {
    node.refuse(fmt::format("has {} values for {} gyros", values.size(), gyros), "give one for each gyro");
  }
  for (std::size_t k = 0; k < std::min(gyros, std::size_t{kMaxGyros}); ++k) {
    clocks.late_s[static_cast<int>(k)] = values[k].number(limits::kLatency_s);
  }
}

Members clock_members(ClockCorrection& clocks, std::size_t gyros) {
  return {number_member("clock_offset_s", clocks.offset_s, limits::kClockOffset_s,
                        "a fix stamped t gives the attitude at t + this + clock_rate_s_s (t - epoch)"),
          number_member("clock_rate_s_s", clocks.rate_s_s, limits::kClockRate_s_s, "of the star tracker"),
          {"latency_s", "of each gyro: a reading stamped t holds the direction at t - this",
           array_of(number_schema(limits::kLatency_s)),
           [&clocks, gyros](const JsonNode& node) { read_latencies(node, gyros, clocks); }}};
}

Json clocks_json(const ClockCorrection& clocks, std::size_t gyros) {
  return {{"clock_offset_s", clocks.offset_s},
          {"clock_rate_s_s", clocks.rate_s_s},
          {"latency_s", std::vector<double>(clocks.late_s.begin(),
                                            clocks.late_s.begin() +
                                                static_cast<std::ptrdiff_t>(std::min(gyros, std::size_t{kMaxGyros})))}};
}

Members determined_members(Determined& determined) {
  constexpr int kMost = Layout::kEq1 * kMaxGyros;
  const auto member = [](std::string_view key, int& target, std::string_view about) -> Member {
    return {key, about, whole_schema(0, kMost), [&target](const JsonNode& node) {
              target = static_cast<int>(node.number({0, kMost, "", "it is a number of coefficients"}));
            }};
  };
  return {member("coefficients", determined.coefficients, "of eq. (1), known at least twice as well as before"),
          member("of", determined.of, "")};
}

Time parse_epoch_node(const JsonNode& node) {
  const std::string epoch = node.text();
  const std::optional<Time> parsed = parse_epoch(epoch);
  if (!parsed) {
    node.refuse(fmt::format("is {}, not an ISO date and time", in_quotes(epoch)),
                "write it like \"2009-05-20T00:00:00\"");
  }
  return *parsed;
}

void check_format(const JsonNode& node) {
  if (const std::string format = node.text(); format != kFormat) {
    node.refuse(fmt::format("is {}", in_quotes(format)), fmt::format("give a file with format \"{}\"", kFormat));
  }
}

void read_time(const JsonNode& node, Calibration& calibration) {
  const double t_s = node.number(limits::kTimeOfCalibration_s);
  calibration.t = calibration.epoch + from_seconds(t_s);
}

void read_gyros(const JsonNode& node, Calibration& calibration) {
  for (const JsonNode& element : node.elements()) {
    read_members(element, gyro_members(calibration.gyros.emplace_back()));
  }
  if (calibration.gyros.empty()) {
    node.refuse("is empty", "give one element per gyro");
  }
  const auto rate = [](const GyroCalibration& gyro) {
    return gyro.orbital_drift ? std::optional(gyro.orbital_drift->rate_rad_s) : std::nullopt;
  };
  for (GyroCalibration& gyro : calibration.gyros) {
    if (rate(gyro) != rate(calibration.gyros.front())) {
      node.refuse("has drift at orbital period of different rates", "give it to all gyros, of one rate, or to none");
    }
    if (gyro.orbital_drift) {
      gyro.orbital_drift->zero_at = calibration.epoch;
    }
    if (gyro.polhode.has_value() != calibration.gyros.front().polhode.has_value()) {
      node.refuse("has coefficients that come and go with the polhode of some gyros alone",
                  "give it to all gyros, or to none");
    }
    if (gyro.polhode) {
      gyro.polhode->zero_at = calibration.epoch;
    }
  }
}

void read_further(const JsonNode& node, Calibration& calibration) {
  for (const auto& [name, estimate] : node.members()) {
    const double value = estimate.at("value").number(limits::kFurtherState);
    const double sigma = estimate.at("sigma").number(limits::kFurtherStateSigma);
    if (const std::optional<ParameterId> parameter = parameter_named(name)) {
      calibration.further.push_back({*parameter, value, sigma});
    }
  }
}

Members verdict_members(Verdict& verdict) {
  Finding finding;
  return {flag_member("trustworthy", verdict.trustworthy, "false: do not use"),
          {"findings", "why, and what else was found", array_of(schema_of(finding_members(finding))),
           [&verdict](const JsonNode& node) {
             for (const JsonNode& element : node.elements()) {
               verdict.findings.push_back(parse_finding(element));
             }
           }}};
}

/// In the order of the file: the epoch is needed by what comes after it.
Members calibration_members(Calibration& calibration) {
  GyroCalibration gyro;
  CalibrationNoise noise;
  ClockCorrection clocks;
  DriftFieldLevel level;
  OnBoardDrift on_board;
  Determined determined;
  OpenLoopForecast forecast;
  std::vector<std::string> names;
  Json gyros = array_of(schema_of(gyro_members(gyro)));
  gyros["minItems"] = 1;
  const Json estimate = object_of(
      {{"value", "", number_schema(limits::kFurtherState)}, {"sigma", "", number_schema(limits::kFurtherStateSigma)}},
      true);
  const Json statistic = {{"type", Json::array({"number", "null"})}};
  return {
      {"format", "", {{"const", kFormat}}, check_format},
      version_member(kVersion),
      {"estimator", "how it was made", estimator_schema(),
       [&](const JsonNode& node) { calibration.estimator = parse_estimator(node); }},
      {"epoch_tai", "start of the pass, TAI", epoch_schema(),
       [&](const JsonNode& node) { calibration.epoch = parse_epoch_node(node); }},
      optional_member({"start_up", "of the rotors, where the pass names it; coefficients change at every start",
                       text_schema(), [&](const JsonNode& node) { calibration.start_up = node.text(); }}),
      {"t_s", "since the epoch: when momentum_in holds", number_schema(limits::kTimeOfCalibration_s),
       [&](const JsonNode& node) { read_time(node, calibration); }},
      {"gyros", "one element per gyro", gyros, [&](const JsonNode& node) { read_gyros(node, calibration); }},
      optional_member({"further", "further states by name", object_of({}, estimate),
                       [&](const JsonNode& node) { read_further(node, calibration); }}),
      optional_member(
          {"orbital_rate_rad_s", "by which an error of the star trackers at orbital period is estimated",
           number_schema(limits::kOrbitalRate_rad_s),
           [&](const JsonNode& node) { calibration.orbital_rate_rad_s = node.number(limits::kOrbitalRate_rad_s); }}),
      optional_member({"clocks", "how far the stamps of the telemetry are off, as in pass.toml, whose own are in it",
                       schema_of(clock_members(clocks, kMaxGyros)),
                       [&](const JsonNode& node) {
                         read_members(node, clock_members(calibration.clocks.emplace(), calibration.gyros.size()));
                       }}),
      optional_member({"noise", "that it went by", schema_of(noise_members(noise)),
                       [&](const JsonNode& node) { read_members(node, noise_members(calibration.noise.emplace())); }}),
      optional_member({"drift_field", "drift outside eq. (1) by potential and degree, where it is estimated as a field",
                       array_of(schema_of(level_members(level, kMaxGyros))),
                       [&](const JsonNode& node) {
                         for (const JsonNode& element : node.elements()) {
                           read_members(element, level_members(calibration.drift_field.emplace_back(),
                                                               calibration.gyros.size()));
                         }
                       }}),
      optional_member(
          {"drift_on_board", "what an estimator on board takes of the field", schema_of(on_board_members(on_board)),
           [&](const JsonNode& node) { read_members(node, on_board_members(calibration.on_board_drift.emplace())); }}),
      optional_member(
          {"determined", "how many drift coefficients the pass determines", schema_of(determined_members(determined)),
           [&](const JsonNode& node) { read_members(node, determined_members(calibration.determined.emplace())); }}),
      optional_member(
          {"forecast", "attitude error predicted for an open loop from a correction at the end of the pass",
           schema_of(forecast_members(forecast)),
           [&](const JsonNode& node) { read_members(node, forecast_members(calibration.forecast.emplace())); }}),
      {"covariance", "of the estimate at t_s; alignments as small rotations, c axes",
       schema_of(covariance_members(calibration, names)),
       [&](const JsonNode& node) {
         std::vector<std::string> states;
         read_members(node, covariance_members(calibration, states));
       }},
      {"verdict", "whether to use it", schema_of(verdict_members(calibration.verdict)),
       [&](const JsonNode& node) { read_members(node, verdict_members(calibration.verdict)); }},
      {"statistics", "numbers that judge it", object_of({}, statistic), [&](const JsonNode& node) {
         for (const auto& [name, value] : node.members()) {
           set_value(calibration.statistics, name,
                     value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.number());
         }
       }}};
}

/// An array with each element on its own line, which is how a person looks at a matrix or a list of findings.
std::string lines(const Json& array) {
  std::string text;
  for (const Json& element : array) {
    text += fmt::format("{}\n   {}", text.empty() ? "" : ",", dump(element));
  }
  return "[" + text + "]";
}

/// With the amplitudes of drift that comes back behind the states, as it is told from the epoch.
Eigen::MatrixXd covariance_of_all(const Calibration& calibration) {
  const Eigen::MatrixXd& amplitudes = calibration.amplitude_covariance;
  if (amplitudes.size() == 0) {
    return calibration.covariance;
  }
  const Eigen::Index states = calibration.covariance.rows();
  Eigen::MatrixXd all(states + amplitudes.rows(), states + amplitudes.rows());
  all.topLeftCorner(states, states) = calibration.covariance;
  all.bottomRows(amplitudes.rows()) = amplitudes;
  all.topRightCorner(states, amplitudes.rows()) = amplitudes.leftCols(states).transpose();
  return all;
}

}  // namespace

Calibration read_calibration(const std::filesystem::path& path) {
  const TextFile file(path);
  refuse_other_than_text(file.text(), path);
  if (!begins_as_json(file.text())) {
    throw InputRefused(path, {}, "is no calibration.json: it does not begin with {",
                       "give the calibration.json that `trihedron calibrate` writes; `import` makes one of an ACM");
  }
  return parse_calibration(file.text(), path);
}

Calibration parse_calibration(std::string_view text, const std::filesystem::path& file) {
  const Json document = parse_json(text, file);
  Calibration calibration;
  read_members(JsonNode(document, file), calibration_members(calibration));
  return calibration;
}

Json calibration_schema() {
  Calibration calibration;
  return document_schema("Calibration",
                         "calibration.json: what a calibration found, its covariance and its verdict. Further keys may "
                         "be added.",
                         schema_of(calibration_members(calibration)));
}

std::string format_calibration(const Calibration& calibration) {
  Json gyros = Json::array();
  for (const GyroCalibration& gyro : calibration.gyros) {
    gyros.push_back(gyro_json(gyro, calibration.epoch));
  }
  Json matrix = Json::array();
  const Eigen::MatrixXd covariance = covariance_of_all(calibration);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    const Eigen::RowVectorXd row = covariance.row(i);
    matrix.push_back(std::vector<double>(row.begin(), row.end()));
  }
  Json further = Json::object();
  for (const FurtherEstimate& estimate : calibration.further) {
    further[name_of(estimate.parameter)] = {{"value", estimate.value}, {"sigma", estimate.sigma}};
  }
  const std::string orbital_rate =
      calibration.orbital_rate_rad_s
          ? fmt::format(" \"orbital_rate_rad_s\": {},\n", dump(Json(*calibration.orbital_rate_rad_s)))
          : "";
  Json states = Json::array();
  for (const ParameterId& state : calibration.states) {
    states.push_back(name_of(state));
  }
  if (calibration.amplitude_covariance.size() > 0) {
    for (const std::string& amplitude : amplitudes_of(calibration)) {
      states.push_back(amplitude);
    }
  }
  Json statistics = Json::object();
  for (const auto& [name, value] : named_values(calibration.statistics)) {
    statistics[name] = value;
  }
  const std::string start_up =
      calibration.start_up.empty() ? "" : fmt::format(" \"start_up\": {},", dump(Json(calibration.start_up)));
  const std::string clocks =
      calibration.clocks
          ? fmt::format(" \"clocks\": {},\n", dump(clocks_json(*calibration.clocks, calibration.gyros.size())))
          : "";
  const std::string noise =
      calibration.noise ? fmt::format(" \"noise\": {},\n", dump(noise_json(*calibration.noise))) : "";
  Json levels = Json::array();
  for (const DriftFieldLevel& level : calibration.drift_field) {
    levels.push_back(level_json(level));
  }
  const std::string field = levels.empty() ? "" : fmt::format(" \"drift_field\": {},\n", lines(levels));
  const std::string on_board =
      calibration.on_board_drift
          ? fmt::format(" \"drift_on_board\": {},\n",
                        dump({{"drift_model", name_of(calibration.on_board_drift->drift_model)},
                              {"random_walk_rad_sqrt_s", calibration.on_board_drift->random_walk_rad_sqrt_s}}))
          : "";
  const std::string determined =
      calibration.determined
          ? fmt::format(" \"determined\": {},\n", dump({{"coefficients", calibration.determined->coefficients},
                                                        {"of", calibration.determined->of}}))
          : "";
  const std::string forecast =
      calibration.forecast ? fmt::format(" \"forecast\": {},\n", dump(forecast_json(*calibration.forecast))) : "";
  Json findings = Json::array();
  for (const Finding& finding : calibration.verdict.findings) {
    findings.push_back(finding_json(finding));
  }
  return fmt::format(
      "{{\"format\": \"{}\", \"version\": {},\n"
      " \"estimator\": {}, \"epoch_tai\": \"{}\",{} \"t_s\": {},\n"
      " \"gyros\": {},\n"
      " \"further\": {},\n{}{}{}{}{}{}{}"
      " \"covariance\": {{\n  \"states\": {},\n  \"matrix\": {}}},\n"
      " \"verdict\": {{\"trustworthy\": {}, \"findings\": {}}},\n"
      " \"statistics\": {}}}\n",
      kFormat, kVersion, dump(Json(name_of(calibration.estimator))), format_epoch(calibration.epoch), start_up,
      dump(Json(to_seconds(calibration.t - calibration.epoch))), lines(gyros), dump(further), orbital_rate, clocks,
      noise, field, on_board, determined, forecast, dump(states), lines(matrix), calibration.verdict.trustworthy,
      lines(findings), dump(statistics));
}

void write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  write_file(path, format_calibration(calibration));
}

}  // namespace trihedron::io
