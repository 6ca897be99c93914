#include "trihedron/io/scenario.hpp"

#include <fmt/format.h>

#include <functional>
#include <initializer_list>
#include <sstream>
#include <utility>

#include "text_file.hpp"
#include "toml_table.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// A key of a table, and what to do with its value.
struct Field {
  std::string_view key;
  std::function<void(const TomlTable&, const toml::node&)> read;
};
using Fields = std::vector<Field>;

Fields operator+(Fields a, const Fields& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void read_fields(const toml::table& table, const fs::path& file, const std::string& name, const Fields& fields) {
  std::vector<std::string_view> known;
  for (const Field& field : fields) {
    known.push_back(field.key);
  }
  const TomlTable reader(table, file, name, known);
  for (const Field& field : fields) {
    if (const toml::node* node = reader.find(field.key)) {
      try {
        field.read(reader, *node);
      } catch (const UsageError& error) {
        reader.refuse(*node, fmt::format("\"{}\" in {}: {}", field.key, name, error.what()), "correct the value");
      }
    }
  }
}

// Quantities that only scenarios have.

struct UnitOfMeasure {
  std::string_view name;
  double factor;
};

double parse_in(std::string_view text, std::initializer_list<UnitOfMeasure> units) {
  std::string accepted;
  for (const UnitOfMeasure& unit : units) {
    if (text.ends_with(unit.name)) {
      return parse_number(trimmed(text.substr(0, text.size() - unit.name.size()))) * unit.factor;
    }
    accepted += accepted.empty() ? "" : ", ";
    accepted += unit.name;
  }
  throw UsageError(fmt::format("{} has no known unit; accepted units: {}", in_quotes(text), accepted));
}

double length_m(std::string_view text) {
  return within(limits::kLength_m, parse_in(text, {{"km", 1e3}, {"m", 1}}), text);
}
double frequency_hz(std::string_view text) { return within(limits::kFrequency_hz, parse_in(text, {{"Hz", 1}}), text); }
double acceleration_rad_s2(std::string_view text) {
  return within(limits::kAcceleration_rad_s2, parse_in(text, {{"deg/s^2", kDegree}, {"rad/s^2", 1}}), text);
}
double rate_walk_rad_s_sqrt_s(std::string_view text) {
  return within(limits::kRateWalk_rad_s_sqrt_s, parse_in(text, {{"deg/h/s^0.5", kDegree / 3600}, {"rad/s/s^0.5", 1}}),
                text);
}
double interval_s(std::string_view text) {
  return to_seconds(within(limits::kInterval_s, parse_signed_duration(text), text));
}
double angle_rad(std::string_view text) { return within(limits::kAngle_rad, parse_angle_rad(text), text); }
double rate_rad_s(std::string_view text) { return within(limits::kRate_rad_s, parse_rate_rad_s(text), text); }
double random_walk_rad_sqrt_s(std::string_view text) {
  return within(limits::kScenarioRandomWalk_rad_sqrt_s, parse_random_walk_rad_sqrt_s(text), text);
}
Duration pass_duration(std::string_view text) { return within(limits::kPassDuration_s, parse_duration(text), text); }
Duration gyro_period(std::string_view text) { return within(limits::kGyroPeriod_s, parse_duration(text), text); }
Duration star_tracker_period(std::string_view text) {
  return within(limits::kStarTrackerPeriod_s, parse_duration(text), text);
}

/// The text of a value with a unit.
std::string quantity_text(const TomlTable& table, const toml::node& node, std::string_view key) {
  if (!node.is_string()) {
    table.refuse(node, fmt::format("\"{}\" must be a string with a number and its unit", key),
                 "write the value in quotes with its unit, like \"30deg\", \"3s\" or \"2arcsec\"");
  }
  return table.text(node, key);
}

template <class T, class Parse>
Field quantity(std::string_view key, T& target, Parse parse) {
  return {key, [key, &target, parse](const TomlTable& table, const toml::node& node) {
            target = parse(quantity_text(table, node, key));
          }};
}

/// Three values about or along x, y, z; a unit in each.
template <class T, class Parse>
Field three(std::string_view key, T& target, Parse parse) {
  return {key, [key, &target, parse](const TomlTable& table, const toml::node& node) {
            const toml::array* array = node.as_array();
            if (array == nullptr || array->size() != 3) {
              table.refuse(node, fmt::format("\"{}\" is not a list of three", key), "give [x, y, z]");
            }
            Eigen::Vector3d values;
            for (int i = 0; i < 3; ++i) {
              values(i) = parse(quantity_text(table, (*array)[static_cast<std::size_t>(i)], key));
            }
            target = values;
          }};
}

Field pure_three(std::string_view key, Eigen::Vector3d& target) {
  return {key, [key, &target](const TomlTable& table, const toml::node& node) {
            target = table.three_numbers(node, key, limits::kPureNumber);
          }};
}

Field pure(std::string_view key, double& target) {
  return {key, [key, &target](const TomlTable& table, const toml::node& node) {
            target = table.number(node, key, limits::kPureNumber);
          }};
}

template <class Integer>
Field whole(std::string_view key, Integer& target) {
  return {key, [key, &target](const TomlTable& table, const toml::node& node) {
            const std::optional<Integer> value = node.is_integer() ? node.value<Integer>() : std::nullopt;
            if (!value) {
              table.refuse(node, fmt::format("\"{}\" is not a whole number in range", key), "give a whole number");
            }
            target = *value;
          }};
}

Field text(std::string_view key, std::string& target) {
  return {key, [key, &target](const TomlTable& table, const toml::node& node) { target = table.text(node, key); }};
}

/// One word of a list.
template <class T>
Field choice(std::string_view key, T& target, std::vector<std::pair<std::string_view, T>> words) {
  return {key, [key, &target, words = std::move(words)](const TomlTable& table, const toml::node& node) {
            const std::string given = table.text(node, key);
            std::vector<std::string_view> known;
            for (const auto& [word, value] : words) {
              if (given == word) {
                target = value;
                return;
              }
              known.push_back(word);
            }
            table.refuse(node, fmt::format("\"{}\" cannot be {}", key, in_quotes(given)), suggestion(given, known));
          }};
}

Field section(std::string_view key, const fs::path& file, std::string name, std::function<Fields()> fields) {
  return {key, [key, &file, name = std::move(name), fields = std::move(fields)](const TomlTable& table,
                                                                                const toml::node& node) {
            read_fields(table.as_table(node, key), file, name, fields());
          }};
}

/// An array of tables, each read by its own fields into a new element.
template <class T>
Field list(std::string_view key, const fs::path& file, std::vector<T>& target, Fields (*fields)(T&)) {
  return {key, [key, &file, &target, fields](const TomlTable& table, const toml::node& node) {
            const toml::array* array = node.as_array();
            if (array == nullptr || !(array->empty() || array->is_array_of_tables())) {
              table.refuse(node, fmt::format("\"{}\" is not an array of tables", key),
                           fmt::format("begin each element with [[…{}]]", key));
            }
            target.clear();
            for (const toml::node& element : *array) {
              read_fields(*element.as_table(), file, fmt::format("\"{}\" {}", key, target.size() + 1),
                          fields(target.emplace_back()));
            }
          }};
}

Fields interval_fields(Interval& interval) {
  return {quantity("begin", interval.begin_s, interval_s), quantity("end", interval.end_s, interval_s)};
}

Fields scenario_fields(Scenario& scenario) {
  return {text("spacecraft", scenario.spacecraft),
          whole("seed", scenario.seed),
          {"epoch_tai",
           [&scenario](const TomlTable& table, const toml::node& node) {
             const std::string iso = table.text(node, "epoch_tai");
             const std::optional<Time> epoch = parse_epoch(iso);
             if (!epoch) {
               table.refuse(node, fmt::format("\"epoch_tai\" is {}, not a date and time", in_quotes(iso)),
                            "write it like \"2009-05-20T00:00:00\", TAI");
             }
             scenario.epoch = *epoch;
           }},
          quantity("duration", scenario.duration, pass_duration)};
}

Fields orbit_fields(OrbitScenario& orbit) {
  return {quantity("perigee_altitude", orbit.perigee_altitude_m, length_m),
          quantity("apogee_altitude", orbit.apogee_altitude_m, length_m),
          quantity("inclination", orbit.inclination_rad, angle_rad),
          quantity("ascending_node", orbit.ascending_node_rad, angle_rad),
          quantity("argument_of_perigee", orbit.argument_of_perigee_rad, angle_rad),
          quantity("mean_anomaly", orbit.mean_anomaly_rad, angle_rad)};
}

Fields slew_fields(Slew& slew) {
  return {quantity("begin", slew.begin_s, interval_s), quantity("roll", slew.roll_rad, angle_rad),
          quantity("pitch", slew.pitch_rad, angle_rad), quantity("yaw", slew.yaw_rad, angle_rad)};
}

Fields imaging_fields(ImagingProgramme& imaging) {
  return {quantity("max_roll", imaging.max_roll_rad, angle_rad),
          quantity("max_pitch", imaging.max_pitch_rad, angle_rad),
          quantity("mean_rest", imaging.mean_rest_s, interval_s), quantity("dwell", imaging.dwell_s, interval_s)};
}

/// `slews = "none"`, or a list, or [attitude.imaging]; the last is the default.
Fields attitude_fields(AttitudeScenario& attitude, const fs::path& file, Time epoch) {
  using Reference = AttitudeScenario::Reference;
  return {choice<Reference>("reference", attitude.reference,
                            {{"orbital", Reference::kOrbital},
                             {"yaw-steered", Reference::kYawSteered},
                             {"inertial", Reference::kInertial},
                             {"recorded", Reference::kRecorded}}),
          {"inertial_q_in_c",
           [&attitude](const TomlTable& table, const toml::node& node) {
             const toml::array* q = node.as_array();
             if (q == nullptr || q->size() != 4) {
               table.refuse(node, "\"inertial_q_in_c\" is not a list of four", "give [q_x, q_y, q_z, q_w]");
             }
             for (int i = 0; i < 4; ++i) {
               attitude.inertial_q_in_c.coeffs()(i) =
                   table.number((*q)[static_cast<std::size_t>(i)], "inertial_q_in_c");
             }
             if (!(attitude.inertial_q_in_c.norm() > 0)) {
               table.refuse(node, "\"inertial_q_in_c\" is zero", "give a quaternion");
             }
           }},
          {"recorded",
           [&attitude, &file, epoch](const TomlTable& table, const toml::node& node) {
             const AttitudeHistory history = read_attitude(file.parent_path() / table.text(node, "recorded"), epoch);
             attitude.recorded.clear();
             for (std::size_t i = 0; i < history.size(); ++i) {
               attitude.recorded.push_back({to_seconds(history.t[i] - epoch), history.q_in_c[i]});
             }
           }},
          {"slews",
           [&attitude, &file](const TomlTable& table, const toml::node& node) {
             auto& slews = attitude.slews.emplace<std::vector<Slew>>();
             if (!(node.is_string() && table.text(node, "slews") == "none")) {
               list("slews", file, slews, slew_fields).read(table, node);
             }
           }},
          {"imaging",
           [&attitude, &file](const TomlTable& table, const toml::node& node) {
             auto* imaging = std::get_if<ImagingProgramme>(&attitude.slews);
             if (imaging == nullptr) {
               table.refuse(node, "\"imaging\" and \"slews\" are both there", "keep one of them");
             }
             read_fields(table.as_table(node, "imaging"), file, "[attitude.imaging]", imaging_fields(*imaging));
           }},
          quantity("max_slew_rate", attitude.max_slew_rate_rad_s, rate_rad_s),
          quantity("max_slew_acceleration", attitude.max_slew_acceleration_rad_s2, acceleration_rad_s2),
          quantity("jitter", attitude.jitter_rad, angle_rad),
          quantity("jitter_bandwidth", attitude.jitter_bandwidth_hz, frequency_hz)};
}

Fields harmonic_fields(DriftHarmonic& harmonic) {
  using Potential = DriftHarmonic::Potential;
  return {choice<Potential>("potential", harmonic.potential, {{"W", Potential::kW}, {"D", Potential::kD}}),
          whole("degree", harmonic.degree), whole("order", harmonic.order),
          quantity("amplitude", harmonic.amplitude_rad_s, rate_rad_s)};
}

Fields kappa_fields(std::array<double, 7>& kappa) {
  Fields fields;
  for (std::size_t i = 0; i < kappa.size(); ++i) {
    fields.push_back(quantity(Esg7::kNames[i], kappa[i], rate_rad_s));
  }
  return fields;
}

Fields drift_fields(DriftScenario& drift, const fs::path& file) {
  return {section("kappa", file, "\"kappa\"", [&drift] { return kappa_fields(drift.kappa_rad_s.emplace()); }),
          quantity("prior_sigma", drift.prior_sigma_rad_s, rate_rad_s),
          list("harmonics", file, drift.harmonics, harmonic_fields),
          quantity("outside_sigma", drift.outside_sigma_rad_s, rate_rad_s),
          quantity("coefficient_walk", drift.coefficient_walk_rad_s_sqrt_s, rate_walk_rad_s_sqrt_s),
          pure("warm_up_fraction", drift.warm_up_fraction),
          quantity("warm_up_time", drift.warm_up_time_s, interval_s),
          quantity("direction_walk", drift.direction_walk_rad_sqrt_s, random_walk_rad_sqrt_s),
          quantity("markov_sigma", drift.markov_sigma_rad_s, rate_rad_s),
          quantity("markov_time", drift.markov_time_s, interval_s)};
}

Fields readout_fields(ReadoutScenario& readout) {
  return {quantity("noise", readout.noise_rad, angle_rad),
          three("bias", readout.bias_rad, angle_rad),
          pure_three("scale", readout.scale),
          quantity("quantum", readout.quantum_rad, angle_rad),
          pure("dropout_probability", readout.dropout_probability),
          pure("spike_probability", readout.spike_probability),
          quantity("spike", readout.spike_rad, angle_rad),
          pure("stuck_probability", readout.stuck_probability),
          quantity("stuck", readout.stuck_s, interval_s)};
}

Fields unit_fields(GyroScenario& gyro, const fs::path& file) {
  return {pure_three("start_direction_c", gyro.start_direction_c),
          three("mounting_rotation_vector", gyro.mounting_rotation_vector_rad, angle_rad),
          three("misalignment", gyro.misalignment_rad, angle_rad),
          quantity("misalignment_magnitude", gyro.misalignment_magnitude_rad, angle_rad),
          quantity("alignment_prior_sigma", gyro.alignment_prior_sigma_rad, angle_rad),
          section("drift", file, "[gyro.drift]", [&gyro, &file] { return drift_fields(gyro.drift, file); }),
          section("readout", file, "[gyro.readout]", [&gyro] { return readout_fields(gyro.readout); })};
}

/// What [gyro] says of all gyros, and [[gyro.unit]] of each. Without units there are the two of the default.
void read_gyros(const toml::table& table, const fs::path& file, Scenario& scenario) {
  const toml::node* units = table.get("unit");
  if (units != nullptr) {
    if (units->as_array() == nullptr || !units->as_array()->is_array_of_tables()) {
      TomlTable(table, file, "[gyro]", {"unit"})
          .refuse(*units, "\"unit\" is not an array of tables", "begin the part of each gyro with [[gyro.unit]]");
    }
    scenario.gyros.resize(units->as_array()->size());
  }
  for (std::size_t i = 0; i < scenario.gyros.size(); ++i) {
    GyroScenario& gyro = scenario.gyros[i];
    const Fields common = unit_fields(gyro, file);
    read_fields(table, file, "[gyro]",
                Fields{quantity("period", scenario.gyro_period, gyro_period),
                       list("gaps", file, scenario.gyro_gaps, interval_fields),
                       {"unit", [](const TomlTable&, const toml::node&) {}}} +
                    common);
    if (units != nullptr) {
      read_fields(*(*units->as_array())[i].as_table(), file, fmt::format("[[gyro.unit]] {}", i + 1), common);
    }
  }
}

Fields head_fields(StarTrackerScenario& head, const fs::path& file) {
  using Aberration = StarTrackerScenario::Aberration;
  return {three("noise", head.noise_rad, angle_rad),
          quantity("clock_offset", head.clock_offset_s, interval_s),
          quantity("latency", head.latency_s, interval_s),
          three("orbital_sine", head.orbital_sine_rad, angle_rad),
          three("orbital_cosine", head.orbital_cosine_rad, angle_rad),
          three("field_error", head.field_error_rad, angle_rad),
          quantity("field_correlation", head.field_correlation_rad, angle_rad),
          choice<Aberration>("aberration", head.aberration,
                             {{"corrected", Aberration::kCorrected}, {"uncorrected", Aberration::kUncorrected}}),
          quantity("sun_exclusion", head.sun_exclusion_rad, angle_rad),
          quantity("earth_exclusion", head.earth_exclusion_rad, angle_rad),
          quantity("max_rate", head.max_rate_rad_s, rate_rad_s),
          list("outages", file, head.outages, interval_fields),
          pure("dropout_probability", head.dropout_probability),
          pure("outlier_probability", head.outlier_probability),
          quantity("outlier", head.outlier_rad, angle_rad),
          pure("wrong_sign_probability", head.wrong_sign_probability)};
}

/// What [star_tracker] says of all heads, and [[star_tracker.further]] of each other than the first.
void read_star_trackers(const toml::table& table, const fs::path& file, Scenario& scenario) {
  const toml::node* further = table.get("further");
  if (further != nullptr && (further->as_array() == nullptr || !further->as_array()->is_array_of_tables())) {
    TomlTable(table, file, "[star_tracker]", {"further"})
        .refuse(*further, "\"further\" is not an array of tables",
                "begin the part of each further head with [[star_tracker.further]]");
  }
  read_fields(table, file, "[star_tracker]",
              Fields{quantity("period", scenario.star_tracker_period, star_tracker_period),
                     {"further", [](const TomlTable&, const toml::node&) {}}} +
                  head_fields(scenario.star_tracker, file));
  for (std::size_t i = 0; further != nullptr && i < further->as_array()->size(); ++i) {
    StarTrackerScenario head = scenario.star_tracker;
    read_fields(*(*further->as_array())[i].as_table(), file, fmt::format("[[star_tracker.further]] {}", i + 1),
                Fields{three("mounting_rotation_vector", head.mounting_rotation_vector_rad, angle_rad),
                       three("misalignment", head.misalignment_rad, angle_rad),
                       quantity("alignment_prior_sigma", head.alignment_prior_sigma_rad, angle_rad)} +
                    head_fields(head, file));
    scenario.further_star_trackers.push_back(head);
  }
}

}  // namespace

Scenario parse_scenario(std::string_view text, const fs::path& file) {
  const toml::table document = parse_toml(text, file);
  Scenario scenario;
  // In this order: a recorded attitude needs the epoch.
  read_fields(document, file, "the file",
              {section("scenario", file, "[scenario]", [&] { return scenario_fields(scenario); }),
               section("orbit", file, "[orbit]", [&] { return orbit_fields(scenario.orbit); }),
               section("attitude", file, "[attitude]",
                       [&] { return attitude_fields(scenario.attitude, file, scenario.epoch); }),
               {"gyro", [&](const TomlTable& table,
                            const toml::node& node) { read_gyros(table.as_table(node, "gyro"), file, scenario); }},
               {"star_tracker", [&](const TomlTable& table, const toml::node& node) {
                  read_star_trackers(table.as_table(node, "star_tracker"), file, scenario);
                }}});
  return scenario;
}

Scenario read_scenario(const fs::path& file) {
  const TextFile content(file);
  return parse_scenario(content.text(), file);
}

}  // namespace trihedron::io
