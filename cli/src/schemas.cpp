#include "schemas.hpp"

#include <algorithm>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "trihedron/records/finding.hpp"

namespace trihedron::cli {
namespace {

using Json = nlohmann::ordered_json;

/// An object of these keys and no other; one that ends in "?" may be left out.
Json object(std::initializer_list<std::pair<std::string, Json>> keys) {
  Json schema = {{"type", "object"}, {"properties", Json::object()}, {"required", Json::array()}};
  for (const auto& [name, value] : keys) {
    const bool may_lack = name.ends_with('?');
    const std::string key = name.substr(0, name.size() - (may_lack ? 1 : 0));
    schema["properties"][key] = value;
    if (!may_lack) {
      schema["required"].push_back(key);
    }
  }
  schema["additionalProperties"] = false;
  return schema;
}

Json with(Json object_schema, const Json& more) {
  object_schema["properties"].update(more["properties"]);
  for (const Json& key : more["required"]) {
    object_schema["required"].push_back(key);
  }
  return object_schema;
}

Json array(const Json& items) { return {{"type", "array"}, {"items", items}}; }
Json by_name(const Json& value) { return {{"type", "object"}, {"additionalProperties", value}}; }

const Json& text() {
  static const Json schema = {{"type", "string"}};
  return schema;
}
const Json& flag() {
  static const Json schema = {{"type", "boolean"}};
  return schema;
}
const Json& count() {
  static const Json schema = {{"type", "integer"}, {"minimum", 0}};
  return schema;
}
/// null: there is none, or it is infinite.
const Json& number() {
  static const Json schema = {{"type", Json::array({"number", "null"})}};
  return schema;
}

/// Of inspect; null where the pass does not show them. The step: of gyro 0 that of the star tracker.
Json clocks() {
  Json step = object({{"gyro", count()},
                      {"from_s", number()},
                      {"until_s", number()},
                      {"change_s", number()},
                      {"change_sigma_s", number()}});
  step["type"] = Json::array({"object", "null"});
  Json schema = object({{"mid_offset_s", number()},
                        {"mid_offset_sigma_s", number()},
                        {"offset_s", number()},
                        {"offset_sigma_s", number()},
                        {"rate_s_s", number()},
                        {"rate_sigma_s_s", number()},
                        {"reference_gyro", count()},
                        {"gyros_late_s", array(number())},
                        {"gyros_late_sigma_s", array(number())},
                        {"gyros_late_rate_s_s", array(number())},
                        {"gyros_late_rate_sigma_s_s", array(number())},
                        {"step", step}});
  schema["type"] = Json::array({"object", "null"});
  return schema;
}

/// Of inspect; null where there is too little telemetry for it.
Json consistency() {
  const Json mistake = object({{"kind", text()}, {"text", text()}, {"motion_rad", number()}});
  Json schema = object({{"consistent", flag()},
                        {"motion_rad", array(number())},
                        {"allowed_rad", array(number())},
                        {"mistakes", array(mistake)},
                        {"proposal", array(text())}});
  schema["type"] = Json::array({"object", "null"});
  return schema;
}

/// That of the file, as a part of another schema.
Json calibration() {
  const std::vector<io::Schema> schemas = io::schemas();
  Json schema = Json::parse(std::ranges::find(schemas, "calibration", &io::Schema::name)->text());
  schema.erase("$schema");
  return schema;
}

Json pass() {
  const Json defect = object({{"kind", text()}, {"where", text()}, {"count", count()}, {"text", text()}});
  return object({{"spacecraft", text()},
                 {"epoch_tai", text()},
                 {"duration_s", number()},
                 {"gyros", count()},
                 {"gyro_samples", count()},
                 {"fixes", count()},
                 {"defects", array(defect)},
                 {"left_out?", array(text())},
                 {"fixes_of_further_star_trackers?", array(count())},
                 {"periods?", object({{"gyro_s", number()},
                                      {"gyro_told_s", number()},
                                      {"star_tracker_s", number()},
                                      {"star_tracker_told_s", number()}})},
                 {"clocks?", clocks()},
                 {"consistency?", consistency()}});
}

Json interval() {
  return object({{"observed_s", number()}, {"max_total_rad", number()}, {"passed_limit_after_s", number()}});
}

Json evaluation() {
  const Json axes = object({{"roll_rad", number()}, {"pitch_rad", number()}, {"heading_rad", number()}});
  const Json errors = object({{"from_s", number()},
                              {"to_s", number()},
                              {"epochs", count()},
                              {"rms", axes},
                              {"max", axes},
                              {"max_total_rad", number()},
                              {"normalised_square?", number()}});
  return object({{"reference", text()},
                 {"whole", errors},
                 {"per_90_min", array(errors)},
                 {"limit_rad", number()},
                 {"corrections", array(with(object({{"t_s", number()}}), interval()))}});
}

Json extension() {
  const Json pair = object({{"t_s", number()}, {"known_before", interval()}, {"calibrated", interval()}});
  return object({{"corrections", array(pair)}, {"factor", number()}, {"is_lower_bound?", flag()}});
}

/// The names of kFindingSeverities.
Json severity() {
  Json names = Json::array();
  for (const FindingSeverityRow& row : kFindingSeverities) {
    names.push_back(row.name);
  }
  return {{"enum", names}};
}

Json findings() {
  return array(
      object({{"code", text()}, {"text", text()}, {"evidence", text()}, {"cure", text()}, {"severity", severity()}}));
}

Json verdict() { return object({{"trustworthy", flag()}, {"findings", findings()}}); }

Json agreement() {
  return object({{"chi_square", number()}, {"degrees_of_freedom", count()}, {"limit", number()}, {"holds", flag()}});
}

Json calibrate_output() {
  const Json of_pass = object({{"name", text()},
                               {"epoch_tai", text()},
                               {"verdict", verdict()},
                               {"coefficients?", agreement()},
                               {"alignments?", agreement()}});
  const Json evidence =
      object({{"states", text()}, {"log_bayes_factor", number()}, {"accepted", flag()}, {"open_sigma", number()}});
  const Json model = object({{"drift_model", text()},
                             {"coefficients", count()},
                             {"log_likelihood", number()},
                             {"open_loop_rms_rad", number()}});
  const Json state = object({{"determined", flag()}, {"settled_s", number()}});
  return object(
      {{"pass", pass()},
       {"calibration", calibration()},
       {"fixes", by_name(count())},
       {"samples", by_name(count())},
       {"navigation", evaluation()},
       {"attitude", evaluation()},
       {"evidence", array(evidence)},
       {"drift_models", array(model)},
       {"convergence", object({{"alignment_s", number()}, {"drift_s", number()}, {"states", by_name(state)}})},
       {"extension", extension()},
       {"passes?", array(of_pass)}});
}

Json navigate_output() {
  Json readiness =
      object({{"limit_rad", number()}, {"time_s", number()}, {"is_lower_bound", flag()}, {"need_met?", flag()}});
  readiness["type"] = Json::array({"object", "null"});  // null: no pair of gyros is left at the end of the pass
  return object({{"pass", pass()},
                 {"verdict", verdict()},
                 {"readiness", readiness},
                 {"statistics", by_name(number())},
                 {"evaluation", evaluation()}});
}

Json replay_output() {
  const Json durations = object(
      {{"count", count()}, {"p50_s", number()}, {"p99_s", number()}, {"p999_s", number()}, {"longest_s", number()}});
  return object({{"pass", pass()},
                 {"verdict", verdict()},
                 {"statistics", by_name(number())},
                 {"mode", text()},
                 {"faults", array(text())},
                 {"readiness_s", number()},
                 {"predicted_error_rad", number()},
                 {"adoptions", count()},
                 {"withdrawals", count()},
                 {"samples_used", count()},
                 {"samples_thinned", count()},
                 {"samples_rejected", count()},
                 {"fixes_used", count()},
                 {"fixes_rejected", count()},
                 {"samples_not_taken", count()},
                 {"fixes_not_taken", count()},
                 {"attitudes", count()},
                 {"snapshots", count()},
                 {"calls", durations},
                 {"late", durations},
                 {"resumed_s?", number()}});
}

Json evaluate_output() { return with(evaluation(), object({{"extension?", extension()}})); }

Json observe_output() {
  const Json parameter = object({{"name", text()},
                                 {"prior_sigma", number()},
                                 {"sigma", number()},
                                 {"sigma_until", array(number())},
                                 {"angle_gain?", number()}});
  const Json combination = object({{"text", text()},
                                   {"singular_value", number()},
                                   {"attitude_error_rad", number()},
                                   {"unobservable", flag()},
                                   {"harmful", flag()}});
  const Json slew =
      object({{"begin_s", number()}, {"roll_rad", number()}, {"pitch_rad", number()}, {"yaw_rad", number()}});
  const Json gain =
      object({{"text", text()}, {"sigma_before", number()}, {"sigma_after", number()}, {"sigma_simulated?", number()}});
  const Json confirmation = object({{"runs", count()},
                                    {"simulated_over_predicted", number()},
                                    {"nees", number()},
                                    {"parameters", count()},
                                    {"contradicted", flag()}});
  const Json advice = object({{"max_slew_rate_rad_s", number()},
                              {"slews", array(slew)},
                              {"why_no_slews?", text()},
                              {"attitude_error_rad", object({{"before", number()}, {"after", number()}})},
                              {"combinations", array(gain)},
                              {"confirmation?", confirmation}});
  return object({{"rank", count()},
                 {"singular_values", array(number())},
                 {"attitude_error_rad", number()},
                 {"t_s", array(number())},
                 {"parameters", array(parameter)},
                 {"combinations", array(combination)},
                 {"advice?", advice}});
}

Json history_output() {
  const Json entry = object({{"spacecraft", text()},
                             {"pass", text()},
                             {"start_up", text()},
                             {"passes", count()},
                             {"calibration", calibration()}});
  const Json change = object({{"from", text()},
                              {"to", text()},
                              {"coefficients", agreement()},
                              {"alignments", agreement()},
                              {"parameters", by_name(object({{"change", number()}, {"sigma", number()}}))}});
  const Json spread = object({{"state", text()},
                              {"start_ups", count()},
                              {"mean", number()},
                              {"deviation", number()},
                              {"next_sigma", number()}});
  return object({{"calibrations", array(entry)},
                 {"changes", array(change)},
                 {"spreads", array(spread)},
                 {"findings", findings()}});
}

/// Of export and import.
Json interchange_output() {
  return object({{"input", text()},
                 {"input_format", text()},
                 {"written", array(text())},
                 {"output_format", text()},
                 {"epochs", count()},
                 {"segments", count()},
                 {"left_out", count()},
                 {"epoch_tai", text()},
                 {"time_system", text()},
                 {"inertial_frame", text()},
                 {"body_frame", text()},
                 {"object_name", text()},
                 {"object_id", text()},
                 {"covariances_left_out", count()}});
}

Json import_output() {
  return {{"anyOf", Json::array({interchange_output(), with(pass(), object({{"written", text()}}))})}};
}

Json campaign_output() {
  Json consistency = object({{"runs", count()},
                             {"mean", number()},
                             {"degrees_of_freedom", number()},
                             {"usual_low", number()},
                             {"usual_high", number()},
                             {"limit_low", number()},
                             {"limit_high", number()},
                             {"share_of_runs_within_95_percent", number()},
                             {"sigma_factor", number()}});
  consistency["type"] = Json::array({"object", "null"});
  const Json quantile = object({{"share", number()}, {"value", number()}, {"lower", number()}, {"upper", number()}});
  const Json measures = by_name(object({{"unit", text()}, {"runs", count()}, {"quantiles", array(quantile)}}));
  const Json parameter = object({{"runs", count()},
                                 {"rms", number()},
                                 {"sigma", number()},
                                 {"normalised_rms", number()},
                                 {"usual_low", number()},
                                 {"usual_high", number()}});
  const Json word = {{"type", Json::array({"string", "null"})}};  // null: a number
  const Json influence = object({{"key", text()},
                                 {"word", word},
                                 {"measure", text()},
                                 {"runs", count()},
                                 {"rank_correlation", number()},
                                 {"p_value", number()},
                                 {"significant", flag()}});
  const Json outcomes = object({{"trustworthy", count()}, {"do_not_use", count()}, {"failed", count()}});
  const Json cell = object({{"values", by_name(text())},
                            {"outcomes", outcomes},
                            {"nees", consistency},
                            {"nis", consistency},
                            {"measures", measures}});
  const Json worst =
      object({{"run", count()}, {"why", text()}, {"command", text()}, {"measure?", text()}, {"value?", number()}});
  return object({{"campaign", text()},
                 {"seed", count()},
                 {"runs", count()},
                 {"trustworthy", flag()},
                 {"outcomes", outcomes},
                 {"findings", findings()},
                 {"findings_of_runs", by_name(count())},
                 {"reasons_of_failures", by_name(count())},
                 {"nees", consistency},
                 {"nees_of_all", consistency},
                 {"nis", consistency},
                 {"confidence", number()},
                 {"measures", measures},
                 {"measures_of_all", measures},
                 {"parameters", by_name(parameter)},
                 {"cells", array(cell)},
                 {"influences", array(influence)},
                 {"worst", array(worst)}});
}

Json run_output() {
  return object({{"run", count()},
                 {"seed", count()},
                 {"draws", by_name(text())},
                 {"outcome", text()},
                 {"reason", text()},
                 {"drift_model", text()},
                 {"findings", array(text())},
                 {"values", by_name(array(number()))}});
}

io::Schema output(const std::string& command, const std::string& about, Json (*schema)()) {
  return {command + "-output", [command, about, schema] {
            Json document = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                             {"title", "Output of " + command},
                             {"description", about + " SI units, angles in radians; null where there is no number."}};
            document.update(schema());
            return document.dump(1);
          }};
}

}  // namespace

std::vector<io::Schema> all_schemas() {
  std::vector<io::Schema> schemas = io::schemas();
  schemas.push_back(output("inspect", "What inspect and simulate print with --json.", pass));
  schemas.push_back(output("calibrate", "What calibrate and demo print with --json.", calibrate_output));
  schemas.push_back(output("navigate", "What navigate prints with --json.", navigate_output));
  schemas.push_back(output("replay", "What replay prints with --json.", replay_output));
  schemas.push_back(output("evaluate", "What evaluate prints with --json.", evaluate_output));
  schemas.push_back(output("observe", "What observe prints with --json.", observe_output));
  schemas.push_back(output("history", "What history prints with --json.", history_output));
  schemas.push_back(output("export", "What export prints with --json.", interchange_output));
  schemas.push_back(output("import", "What import prints with --json: of an attitude, or of a pass.", import_output));
  schemas.push_back(output("campaign", "What campaign prints with --json.", campaign_output));
  schemas.push_back(output("campaign-run", "What campaign --only prints with --json, and run.json.", run_output));
  return schemas;
}

}  // namespace trihedron::cli
