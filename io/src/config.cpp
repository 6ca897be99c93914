#include "trihedron/io/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "text_file.hpp"
#include "toml_table.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/records/drift_models.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// A text, read by one of the parsers of quantity.hpp or this file.
template <class Parse>
auto parsed(const TomlTable& table, const toml::node& node, std::string_view key, Parse&& parse) {
  if (node.is_number()) {
    table.refuse(node, fmt::format("\"{}\" is a bare number", key), "write it as a text with its unit");
  }
  try {
    return parse(table.text(node, key));
  } catch (const UsageError& error) {
    table.refuse(node, fmt::format("\"{}\": {}", key, error.what()), "correct the value");
  }
}

/// A text with a unit, within a range.
template <class Parse>
auto quantity(const TomlTable& table, const toml::node& node, std::string_view key, const Range& range, Parse&& parse) {
  return parsed(table, node, key, [&](std::string_view text) { return within(range, parse(text), text); });
}

int whole_number(const TomlTable& table, const toml::node& node, std::string_view key, const Range& range) {
  if (!node.is_integer()) {
    table.refuse(node, fmt::format("\"{}\" is not a whole number", key), std::string(range.why));
  }
  return static_cast<int>(table.number(node, key, range));
}

constexpr std::string_view kNever = "never";
constexpr std::string_view kWanderingTime = "wandering_time";

using Choice = FurtherStateOptions::Choice;
constexpr std::array<std::pair<Choice, const char*>, 3> kChoices = {
    {{Choice::kAuto, "auto"}, {Choice::kOff, "off"}, {Choice::kOn, "on"}}};

const char* name_of(Choice choice) {
  return std::ranges::find_if(kChoices, [&](const auto& c) { return c.first == choice; })->second;
}

std::optional<Choice> choice_of(std::string_view text) {
  const auto found = std::ranges::find_if(kChoices, [&](const auto& c) { return c.second == text; });
  return found == kChoices.end() ? std::nullopt : std::optional(found->first);
}

Choice choice(const TomlTable& table, const toml::node& node, std::string_view key) {
  const auto chosen = choice_of(table.text(node, key));
  if (!chosen) {
    table.refuse(node, fmt::format("\"{}\" is neither auto nor on nor off", key), "write one of them");
  }
  return *chosen;
}

/// Of [further_states].
std::vector<std::string_view> further_state_keys() {
  std::vector<std::string_view> keys;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (!row.key.empty()) {
      keys.push_back(row.key);
    }
  }
  keys.push_back(kWanderingTime);
  return keys;
}

/// The lines of [further_states].
std::string format_further_states(const FurtherStateOptions& states) {
  std::string text;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (row.key.empty()) {
      continue;
    }
    const bool has_size = row.state == FurtherState::kWanderingDrift;
    text += fmt::format("{} = \"{}\"  # {}: {}\n", row.key,
                        has_size && states.is_on(row.state) ? fmt::format("{}rad/s", states.wandering_drift_rad_s)
                                                            : name_of(states[row.state]),
                        row.about, has_size ? "auto, off, or its 1-sigma" : "auto, on or off");
  }
  return text + fmt::format("{} = \"{}\"  # and its correlation time\n", kWanderingTime,
                            format_duration(states.wandering_time));
}

}  // namespace

CorrectionOptions parse_correction_interval(std::string_view text) {
  CorrectionOptions corrections;
  if (text == "none") {
    corrections.when = CorrectionOptions::When::kOnlyFirst;
  } else if (text == "continuous") {
    corrections.when = CorrectionOptions::When::kEachFix;
  } else {
    corrections.interval = within(limits::kCorrectionInterval_s, parse_duration(text), text);
  }
  return corrections;
}

std::string format_correction_interval(const CorrectionOptions& corrections) {
  switch (corrections.when) {
    case CorrectionOptions::When::kOnlyFirst:
      return "none";
    case CorrectionOptions::When::kEachFix:
      return "continuous";
    case CorrectionOptions::When::kEvery:
      break;
  }
  return format_duration(corrections.interval);
}

CalibrationOptions read_config(const fs::path& path) {
  const TextFile file(path);
  const toml::table document = parse_toml(file.text(), path);
  const TomlTable root(document, path, "the file",
                       {"estimator", "drift_model", "filter", "further_states", "corrections"});
  CalibrationOptions options;
  if (const toml::node* node = root.find("estimator")) {
    const std::optional<Estimator> estimator = estimator_named(root.text(*node, "estimator"));
    if (!estimator) {
      root.refuse(*node, fmt::format("there is no estimator {}", in_quotes(root.text(*node, "estimator"))),
                  fmt::format("use one of: {}", estimator_choices()));
    }
    options.estimator = *estimator;
  }
  if (const toml::node* node = root.find("drift_model")) {
    const std::string name = root.text(*node, "drift_model");
    options.drift_model = drift_model_named(name);
    if (!options.drift_model && name != kAutoDriftModel) {
      root.refuse(*node, fmt::format("there is no drift model {}", in_quotes(name)),
                  fmt::format("use {}, {}", kAutoDriftModel, drift_model_choices()));
    }
  }
  if (root.find("filter") != nullptr) {
    const TomlTable filter(root.table_at("filter"), path, "[filter]",
                           {"noise", "direction_random_walk", "gate_nis", "student_t_freedom",
                            "reopen_after_rejections", "reopen_after_jump_rejections", "angles_after"});
    if (const toml::node* node = filter.find("noise")) {
      const std::string noise = filter.text(*node, "noise");
      if (noise != "found" && noise != "told") {
        filter.refuse(*node, "\"noise\" is neither found nor told", "write one of them");
      }
      options.find_noise = noise == "found";
    }
    if (const toml::node* node = filter.find("direction_random_walk")) {
      options.direction_random_walk_rad_sqrt_s = quantity(filter, *node, "direction_random_walk",
                                                          limits::kRandomWalk_rad_sqrt_s, parse_random_walk_rad_sqrt_s);
    }
    if (const toml::node* node = filter.find("gate_nis")) {
      options.gate_nis = filter.number(*node, "gate_nis", limits::kGateNis);
    }
    if (const toml::node* node = filter.find("reopen_after_rejections")) {
      options.reopen_after_rejections = whole_number(filter, *node, "reopen_after_rejections", limits::kRejections);
    }
    if (const toml::node* node = filter.find("reopen_after_jump_rejections")) {
      options.reopen_after_jump_rejections =
          whole_number(filter, *node, "reopen_after_jump_rejections", limits::kRejections);
    }
    if (const toml::node* node = filter.find("student_t_freedom")) {
      options.student_t_freedom = filter.number(*node, "student_t_freedom", limits::kStudentTFreedom);
    }
    if (const toml::node* node = filter.find("angles_after")) {
      const bool never = filter.text(*node, "angles_after") == kNever;
      options.angles_after =
          never ? Duration::max() : quantity(filter, *node, "angles_after", limits::kAnglesAfter_s, parse_duration);
    }
  }
  if (root.find("further_states") != nullptr) {
    const TomlTable further(root.table_at("further_states"), path, "[further_states]", further_state_keys());
    FurtherStateOptions& states = options.further_states;
    for (const FurtherStateRow& row : kFurtherStates) {
      const toml::node* node = row.key.empty() ? nullptr : further.find(row.key);
      if (node == nullptr) {
        continue;
      }
      if (row.state != FurtherState::kWanderingDrift) {
        states[row.state] = choice(further, *node, row.key);
      } else if (const auto word = choice_of(further.text(*node, row.key)); word && *word != Choice::kOn) {
        states[row.state] = *word;
      } else {
        states[row.state] = Choice::kOn;
        states.wandering_drift_rad_s =
            quantity(further, *node, row.key, limits::kWanderingDrift_rad_s, parse_rate_rad_s);
      }
    }
    if (const toml::node* node = further.find(kWanderingTime)) {
      states.wandering_time = quantity(further, *node, kWanderingTime, limits::kWanderingTime_s, parse_duration);
    }
  }
  if (root.find("corrections") != nullptr) {
    const TomlTable corrections(root.table_at("corrections"), path, "[corrections]", {"interval"});
    if (const toml::node* node = corrections.find("interval")) {
      options.corrections = parsed(corrections, *node, "interval", parse_correction_interval);
    }
  }
  return options;
}

std::string format_config(const CalibrationOptions& options) {
  return fmt::format(
      "# Settings as given, and the defaults of the others. Give this file to --config to repeat the run.\n"
      "estimator = \"{}\"\n"
      "drift_model = \"{}\"\n"
      "\n"
      "[filter]\n"
      "noise = \"{}\"  # found: from the pass; told: as set here and in pass.toml\n"
      "direction_random_walk = \"{}\"  # process noise of each momentum, per axis across it\n"
      "gate_nis = {}  # a fix with a larger normalised innovation squared is rejected\n"
      "student_t_freedom = {}  # 5 to 20: it is used with less weight instead; 0: rejected\n"
      "reopen_after_rejections = {}  # in a row; then the directions are reopened and the fix is used\n"
      "reopen_after_jump_rejections = {}  # the same where they began with a jump that no drift can make\n"
      "angles_after = \"{}\"  # without a fix, by the angles between the momenta: a duration or never\n"
      "\n"
      "[further_states]  # of estimators invariant and batch\n"
      "{}"
      "\n"
      "[corrections]\n"
      "interval = \"{}\"  # of the open-loop navigator: a duration, none or continuous\n",
      name_of(options.estimator), options.drift_model ? name_of(*options.drift_model) : std::string(kAutoDriftModel),
      options.find_noise ? "found" : "told", format_random_walk(options.direction_random_walk_rad_sqrt_s),
      options.gate_nis, options.student_t_freedom, options.reopen_after_rejections,
      options.reopen_after_jump_rejections,
      options.angles_after == Duration::max() ? std::string(kNever) : format_duration(options.angles_after),
      format_further_states(options.further_states), format_correction_interval(options.corrections));
}

}  // namespace trihedron::io
