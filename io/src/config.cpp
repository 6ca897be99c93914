#include "trihedron/io/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "schemas.hpp"
#include "settings_tables.hpp"
#include "text_file.hpp"
#include "toml_fields.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/records/drift_models.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kNever = "never";
constexpr std::string_view kOnlyFirst = "none";
constexpr std::string_view kEachFix = "continuous";
constexpr std::string_view kNeed = "need";
constexpr std::string_view kNoNeed = "none";
constexpr std::string_view kWanderingTime = "wandering_time";
constexpr std::string_view kChangeCourse = "change_course";
constexpr std::string_view kChangeTime = "change_time";
constexpr std::string_view kPolhodePeriod = "polhode_period";
constexpr std::string_view kPolhodePeriodRate = "polhode_period_rate";

using Choice = FurtherStateOptions::Choice;
constexpr std::array<std::pair<std::string_view, Choice>, 3> kChoices = {
    {{"auto", Choice::kAuto}, {"off", Choice::kOff}, {"on", Choice::kOn}}};

constexpr std::array<std::pair<std::string_view, CourseOfChange::Kind>, 3> kCourses = {
    {{"even", CourseOfChange::Kind::kEven},
     {"warm-up", CourseOfChange::Kind::kWarmUp},
     {"jump", CourseOfChange::Kind::kJump}}};

template <class T, std::size_t N>
std::string_view word_of(const std::array<std::pair<std::string_view, T>, N>& words, T value) {
  return std::ranges::find(words, value, &std::pair<std::string_view, T>::second)->first;
}

std::string_view name_of(Choice choice) { return word_of(kChoices, choice); }

Field estimator(CalibrationOptions& options) {
  return {"estimator", "how the calibration is made", estimator_schema,
          [&options](const TomlTable& table, const toml::node& node) {
            const std::string name = table.text(node, "estimator");
            const std::optional<Estimator> named = estimator_named(name);
            if (!named) {
              table.refuse(node, fmt::format("there is no estimator {}", in_quotes(name)),
                           fmt::format("use one of: {}", estimator_choices()));
            }
            options.estimator = *named;
          }};
}

Field drift_model(CalibrationOptions& options) {
  const auto schema = [] { return Json{{"enum", drift_model_words()}}; };
  return {"drift_model",
          "auto: the one that the pass gives evidence of; field: all members of the drift field, each degree as large "
          "as the pass shows",
          schema, [&options](const TomlTable& table, const toml::node& node) {
            const std::string name = table.text(node, "drift_model");
            if (!set_drift_model(name, options)) {
              table.refuse(node, fmt::format("there is no drift model {}", in_quotes(name)),
                           fmt::format("use {}", drift_model_word_choices()));
            }
          }};
}

/// A duration, or a word that stands for `of_word`.
Field duration_or(std::string_view word, std::string_view key, Duration& target, Duration of_word, const Range& range_s,
                  std::string_view about) {
  return {key, about,
          [word] {
            return any_of({one_of(std::array{word}), quantity_schema(kDuration)});
          },
          [=, &target](const TomlTable& table, const toml::node& node) {
            if (quantity_text(table, node, key) == word) {
              target = of_word;
            } else {
              duration(key, target, range_s, about).read(table, node);
            }
          }};
}

Field need(CalibrationOptions& options) {
  const auto schema = [] {
    return any_of({one_of(std::array{kNoNeed}),
                   Json{{"type", "string"}, {"pattern", " for "}, {"examples", {"5arcmin for 270min"}}}});
  };
  return {kNeed, "accuracy of the attitude without the star tracker, 99.7 %, like 5arcmin for 270min; or none", schema,
          [&options](const TomlTable& table, const toml::node& node) {
            const std::string given = quantity_text(table, node, kNeed);
            options.need = given == kNoNeed ? std::nullopt : std::optional(parse_need(given));
          }};
}

Fields filter_fields(CalibrationOptions& options) {
  return {choice<bool>("noise", options.find_noise, "found: from the pass; told: as set here and in pass.toml",
                       {{"found", true}, {"told", false}}),
          quantity("direction_random_walk", options.direction_random_walk_rad_sqrt_s, kRandomWalk,
                   limits::kRandomWalk_rad_sqrt_s, "process noise of each momentum, per axis across it"),
          one_number("gate_nis", options.gate_nis, limits::kGateNis,
                     "a fix with a larger normalised innovation squared is rejected"),
          one_number("student_t_freedom", options.student_t_freedom, limits::kStudentTFreedom,
                     "5 to 20: it is used with less weight instead; 0: rejected"),
          whole("reopen_after_rejections", options.reopen_after_rejections, limits::kRejections,
                "in a row; then the directions are reopened and the fix is used"),
          whole("reopen_after_jump_rejections", options.reopen_after_jump_rejections, limits::kRejections,
                "the same where they began with a jump that no drift can make"),
          duration_or(kNever, "angles_after", options.angles_after, Duration::max(), limits::kAnglesAfter_s,
                      "without a fix, by the angles between the momenta: a duration or never")};
}

/// auto, off, or its 1-sigma.
Field wandering_drift(const FurtherStateRow& row, FurtherStateOptions& states) {
  static constexpr std::array kWords = {Choice::kAuto, Choice::kOff};
  const auto schema = [] {
    return any_of({one_of(std::array{name_of(kWords[0]), name_of(kWords[1])}), quantity_schema(kRate)});
  };
  return {row.key, row.about, schema, [&row, &states](const TomlTable& table, const toml::node& node) {
            const std::string given = quantity_text(table, node, row.key);
            const auto* const word = std::ranges::find(kWords, given, [](Choice choice) { return name_of(choice); });
            if (word != kWords.end()) {
              states[row.state] = *word;
              return;
            }
            states[row.state] = Choice::kOn;
            states.wandering_drift_rad_s = parse_rate_rad_s(given, limits::kWanderingDrift_rad_s);
          }};
}

/// One value for each gyro; the last one is that of all further ones as well.
template <class Read>
void read_for_each_gyro(const TomlTable& table, const toml::node& node, std::string_view key, const Read& read) {
  const toml::array* const values = node.as_array();
  if (values == nullptr || values->empty() || values->size() > kMaxGyros) {
    table.refuse(node, fmt::format("\"{}\" is no list of one to {} values", key, kMaxGyros),
                 "give one for each gyro, or one for all");
  }
  for (int k = 0; k < kMaxGyros; ++k) {
    read(k, (*values)[std::min(static_cast<std::size_t>(k), values->size() - 1)]);
  }
}

Fields polhode_fields(FurtherStateOptions& states) {
  return {{kPolhodePeriod, "of the polhode of each rotor, at the epoch of the pass",
           [] { return array_of(quantity_schema(kDuration)); },
           [&states](const TomlTable& table, const toml::node& node) {
             read_for_each_gyro(table, node, kPolhodePeriod, [&](int k, const toml::node& value) {
               const std::string given = quantity_text(table, value, kPolhodePeriod);
               const Duration period = parse_duration(given, limits::kPolhodePeriod_s);
               states.polhodes[k].period_s = static_cast<float>(to_seconds(period));
             });
           }},
          {kPolhodePeriodRate, "seconds per second by which the period of each grows",
           [] { return array_of(number_schema(limits::kPolhodePeriodRate)); },
           [&states](const TomlTable& table, const toml::node& node) {
             read_for_each_gyro(table, node, kPolhodePeriodRate, [&](int k, const toml::node& value) {
               states.polhodes[k].period_rate =
                   static_cast<float>(table.number(value, kPolhodePeriodRate, limits::kPolhodePeriodRate));
             });
           }}};
}

/// Of all gyros, as read_for_each_gyro() takes them.
template <class Text>
std::string for_each_gyro(const Text& text) {
  std::string all;
  for (int k = 0; k < kMaxGyros; ++k) {
    all += fmt::format("{}{}", k == 0 ? "" : ", ", text(k));
  }
  return fmt::format("[{}]", all);
}

Fields further_state_fields(FurtherStateOptions& states) {
  Fields fields;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (!row.key.empty()) {
      fields.push_back(row.state == FurtherState::kWanderingDrift
                           ? wandering_drift(row, states)
                           : choice<Choice>(row.key, states[row.state], row.about, {kChoices.begin(), kChoices.end()}));
    }
  }
  fields.push_back(duration(kWanderingTime, states.wandering_time, limits::kWanderingTime_s,
                            "correlation time of the drift that wanders"));
  fields.push_back(choice<CourseOfChange::Kind>(kChangeCourse, states.change_course,
                                                "of the coefficients, where their change is on",
                                                {kCourses.begin(), kCourses.end()}));
  fields.push_back(duration(kChangeTime, states.change_time, limits::kChangeTime_s,
                            "of a warm-up, until 1/e of it is left; of a jump, from the epoch of the pass on"));
  return std::move(fields) + polhode_fields(states);
}

Fields correction_fields(CorrectionOptions& corrections) {
  constexpr std::string_view kKey = "interval";
  const auto schema = [] { return any_of({one_of(std::array{kOnlyFirst, kEachFix}), quantity_schema(kDuration)}); };
  return {{kKey, "of the open-loop navigator: a duration, none or continuous", schema,
           [&corrections, kKey](const TomlTable& table, const toml::node& node) {
             corrections = parse_correction_interval(quantity_text(table, node, kKey));
           }}};
}

Fields file_fields(CalibrationOptions& options, const fs::path& file) {
  return {
      estimator(options),
      drift_model(options),
      need(options),
      section("filter", file, "[filter]", "of estimators invariant and batch", [&] { return filter_fields(options); }),
      section("further_states", file, "[further_states]", "of estimators invariant and batch",
              [&] { return further_state_fields(options.further_states); }),
      section("corrections", file, "[corrections]", "of the navigator",
              [&] { return correction_fields(options.corrections); })};
}

/// Lines of TOML, each commented by what the schema says of its key.
class Writer {
 public:
  explicit Writer(const Json& schema) : schema_(schema), keys_(&schema_.at("properties")) {}

  void section(const std::string& name) {
    const Json& table = schema_.at("properties").at(name);
    text_ += fmt::format("\n[{}]  # {}\n", name, table.at("description").get_ref<const std::string&>());
    keys_ = &table.at("properties");
  }
  void word(std::string_view key, std::string_view value) { number(key, fmt::format("\"{}\"", value)); }
  template <class T>
  void number(std::string_view key, const T& value) {
    const auto& about = keys_->at(std::string(key)).at("description").get_ref<const std::string&>();
    text_ += fmt::format("{} = {}  # {}\n", key, value, about);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  const Json& schema_;
  const Json* keys_;
  std::string text_ =
      "# Settings as given, and the defaults of the others. Give this file to --config to repeat the run.\n";
};

}  // namespace

CorrectionOptions parse_correction_interval(std::string_view text) {
  CorrectionOptions corrections;
  if (text == kOnlyFirst) {
    corrections.when = CorrectionOptions::When::kOnlyFirst;
  } else if (text == kEachFix) {
    corrections.when = CorrectionOptions::When::kEachFix;
  } else {
    try {
      corrections.interval = parse_duration(text, limits::kCorrectionInterval_s);
    } catch (const UsageError& error) {
      throw UsageError(fmt::format("{}; or say {} (only the first correction) or {} (one at each fix)", error.what(),
                                   kOnlyFirst, kEachFix));
    }
  }
  return corrections;
}

std::string format_correction_interval(const CorrectionOptions& corrections) {
  switch (corrections.when) {
    case CorrectionOptions::When::kOnlyFirst:
      return std::string(kOnlyFirst);
    case CorrectionOptions::When::kEachFix:
      return std::string(kEachFix);
    case CorrectionOptions::When::kEvery:
      break;
  }
  return format_duration(corrections.interval);
}

CalibrationOptions read_config(const fs::path& path) {
  const TextFile file(path);
  return parse_config(file.text(), path);
}

CalibrationOptions parse_config(std::string_view text, const fs::path& file) {
  return config_of_table(parse_toml(text, file), file, "the file");
}

CalibrationOptions config_of_table(const toml::table& table, const fs::path& file, const std::string& name) {
  CalibrationOptions options;
  read_fields(table, file, name, file_fields(options, file));
  return options;
}

Json config_table_schema() {
  CalibrationOptions options;
  const fs::path file;
  return schema_of(file_fields(options, file));
}

Json config_schema() {
  return toml_file_schema("Settings", "What --config takes (TOML). What is left out keeps its default.",
                          config_table_schema());
}

std::string format_config(const CalibrationOptions& options) {
  const Json schema = config_schema();
  Writer out(schema);
  out.number(kVersionKey, kTomlVersion);
  out.word("estimator", name_of(options.estimator));
  out.word("drift_model", drift_model_word(options));
  out.word(kNeed, options.need ? format_need(*options.need) : std::string(kNoNeed));

  out.section("filter");
  out.word("noise", options.find_noise ? "found" : "told");
  out.word("direction_random_walk", format_random_walk(options.direction_random_walk_rad_sqrt_s));
  out.number("gate_nis", options.gate_nis);
  out.number("student_t_freedom", options.student_t_freedom);
  out.number("reopen_after_rejections", options.reopen_after_rejections);
  out.number("reopen_after_jump_rejections", options.reopen_after_jump_rejections);
  out.word("angles_after",
           options.angles_after == Duration::max() ? std::string(kNever) : format_duration(options.angles_after));

  out.section("further_states");
  const FurtherStateOptions& states = options.further_states;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (!row.key.empty()) {
      const bool has_size = row.state == FurtherState::kWanderingDrift && states.is_on(row.state);
      out.word(row.key, has_size ? fmt::format("{}rad/s", states.wandering_drift_rad_s)
                                 : std::string(name_of(states[row.state])));
    }
  }
  out.word(kWanderingTime, format_duration(states.wandering_time));
  out.word(kChangeCourse, word_of(kCourses, states.change_course));
  out.word(kChangeTime, format_duration(states.change_time));
  out.number(kPolhodePeriod, for_each_gyro([&](int k) {
               const auto period_s = static_cast<double>(states.polhodes[k].period_s);
               return fmt::format("\"{}\"", format_duration(from_seconds(period_s)));
             }));
  out.number(kPolhodePeriodRate,
             for_each_gyro([&](int k) { return fmt::format("{}", states.polhodes[k].period_rate); }));

  out.section("corrections");
  out.word("interval", format_correction_interval(options.corrections));
  return out.text();
}

}  // namespace trihedron::io
