#include "trihedron/io/scenario.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "oem.hpp"
#include "schemas.hpp"
#include "settings_tables.hpp"
#include "text_file.hpp"
#include "toml_fields.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/quantity.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// Refuses also what `check`, which is given the table and the value where the key stands, does not allow.
template <class Check>
Field checked(Field field, const Check& check) {
  field.read = [read = std::move(field.read), check](const TomlTable& table, const toml::node& node) {
    read(table, node);
    check(table, node);
  };
  return field;
}

/// Same, of a list: `check` is given each element, and the place where it stands.
template <class T, class FieldsOf, class Check>
Field checked_list(std::string_view key, const fs::path& file, std::vector<T>& target, std::string_view about,
                   FieldsOf fields, const Check& check) {
  return checked(list(key, file, target, about, fields),
                 [&target, check](const TomlTable& table, const toml::node& node) {
                   for (std::size_t i = 0; i < target.size(); ++i) {
                     check(target[i], table, (*node.as_array())[i]);
                   }
                 });
}

/// `vector` is a direction, of any length but 0.
template <class Vector>
Field direction(std::string_view key, Vector& vector, std::string_view about) {
  return checked(three_numbers(key, vector, limits::kPureNumber, about),
                 [key](const TomlTable& table, const toml::node& node) {
                   // Squares of very small numbers are zero.
                   if (!(table.three_numbers(node, key).norm() > 0)) {
                     table.refuse(node, fmt::format("\"{}\" is zero, which is no direction", key),
                                  "give a vector of any other length, as one of length 1");
                   }
                 });
}

Fields interval_fields(Interval& interval) {
  return {signed_duration("begin", interval.begin_s, "since the start of the pass"),
          required(signed_duration("end", interval.end_s, "since the start of the pass"))};
}

Field intervals(std::string_view key, const fs::path& file, std::vector<Interval>& target, std::string_view about) {
  return checked_list(key, file, target, about, interval_fields,
                      [key](const Interval& interval, const TomlTable& table, const toml::node& place) {
                        if (interval.end_s < interval.begin_s) {
                          table.refuse(place,
                                       fmt::format("an interval of \"{}\" ends at {}, before it begins at {}", key,
                                                   format_duration(from_seconds(interval.end_s)),
                                                   format_duration(from_seconds(interval.begin_s))),
                                       "give an \"end\" after \"begin\"");
                        }
                      });
}

Fields scenario_fields(Scenario& scenario) {
  return {text("spacecraft", scenario.spacecraft, "its name"),
          whole("seed", scenario.seed, "every random draw depends on it alone"),
          epoch("epoch_tai", scenario.epoch, "start of the pass, TAI"),
          duration("duration", scenario.duration, limits::kPassDuration_s, "of the pass")};
}

Field ephemeris(OrbitScenario& orbit, const fs::path& file, Time epoch) {
  return {"ephemeris", "in place of the elements: an orbit ephemeris message (CCSDS OEM), beside this file",
          text_schema, [&orbit, &file, epoch](const TomlTable& table, const toml::node& node) {
            const fs::path oem = file.parent_path() / table.text(node, "ephemeris");
            orbit.ephemeris = parse_orbit_message(TextFile(oem).text(), oem, epoch).segments;
          }};
}

Fields orbit_fields(OrbitScenario& orbit, const fs::path& file, Time epoch) {
  return {
      ephemeris(orbit, file, epoch),
      quantity("perigee_altitude", orbit.perigee_altitude_m, kLength, limits::kAltitude_m,
               "above the equatorial radius"),
      quantity("apogee_altitude", orbit.apogee_altitude_m, kLength, limits::kAltitude_m, "above the equatorial radius"),
      quantity("inclination", orbit.inclination_rad, kAngle, limits::kHalfTurn_rad,
               "mean element at the start of the pass"),
      quantity("ascending_node", orbit.ascending_node_rad, kAngle, "mean element at the start of the pass"),
      quantity("argument_of_perigee", orbit.argument_of_perigee_rad, kAngle, "mean element at the start of the pass"),
      quantity("mean_anomaly", orbit.mean_anomaly_rad, kAngle, "mean element at the start of the pass")};
}

Fields slew_fields(Slew& slew) {
  return {signed_duration("begin", slew.begin_s, "since the start of the pass"),
          quantity("roll", slew.roll_rad, kAngle, "of the attitude that is held after it"),
          quantity("pitch", slew.pitch_rad, kAngle, "of the attitude that is held after it"),
          quantity("yaw", slew.yaw_rad, kAngle, "of the attitude that is held after it")};
}

Fields imaging_fields(ImagingProgramme& imaging) {
  return {quantity("max_roll", imaging.max_roll_rad, kAngle, limits::kSizeOfAngle_rad, "of the targets"),
          quantity("max_pitch", imaging.max_pitch_rad, kAngle, limits::kSizeOfAngle_rad, "of the targets"),
          signed_duration("mean_rest", imaging.mean_rest_s, limits::kMeanRest_s,
                          "between slews, exponentially distributed"),
          signed_duration("dwell", imaging.dwell_s, limits::kStretch_s, "at the target")};
}

Field inertial_attitude(AttitudeScenario& attitude) {
  constexpr std::string_view kKey = "inertial_q_in_c";
  const auto schema = [] {
    Json four = array_of(number_schema());
    four["minItems"] = 4;
    four["maxItems"] = 4;
    return four;
  };
  return {kKey, "of reference inertial: q_x, q_y, q_z, q_w", schema,
          [&attitude, kKey](const TomlTable& table, const toml::node& node) {
            const toml::array* q = node.as_array();
            if (q == nullptr || q->size() != 4) {
              table.refuse(node, fmt::format("\"{}\" is not a list of four", kKey), "give [q_x, q_y, q_z, q_w]");
            }
            for (int i = 0; i < 4; ++i) {
              attitude.inertial_q_in_c.coeffs()(i) = table.number((*q)[static_cast<std::size_t>(i)], kKey);
            }
            if (!(attitude.inertial_q_in_c.norm() > 0)) {
              table.refuse(node, fmt::format("\"{}\" is zero", kKey), "give a quaternion");
            }
          }};
}

Field recorded_attitude(AttitudeScenario& attitude, const fs::path& file, Time epoch) {
  return {"recorded", "of reference recorded: an attitude file (CSV), CCSDS AEM or SPICE CK, beside this one",
          text_schema, [&attitude, &file, epoch](const TomlTable& table, const toml::node& node) {
            const AttitudeHistory history = read_attitude(file.parent_path() / table.text(node, "recorded"), epoch);
            attitude.recorded.clear();
            for (std::size_t i = 0; i < history.size(); ++i) {
              attitude.recorded.push_back({to_seconds(history.t[i] - epoch), history.q_in_c[i]});
            }
          }};
}

/// "none", or a list.
Field slews(AttitudeScenario& attitude, const fs::path& file) {
  static constexpr std::string_view kNone = "none";
  const auto schema = [] {
    Slew slew;
    return any_of({one_of(std::array{kNone}), array_of(schema_of(slew_fields(slew)))});
  };
  return {"slews", "none, or a list, in place of [attitude.imaging]", schema,
          [&attitude, &file](const TomlTable& table, const toml::node& node) {
            auto& flown = attitude.slews.emplace<std::vector<Slew>>();
            if (!(node.is_string() && table.text(node, "slews") == kNone)) {
              list("slews", file, flown, "", slew_fields).read(table, node);
            }
          }};
}

Field imaging(AttitudeScenario& attitude, const fs::path& file) {
  const auto schema = [] {
    ImagingProgramme programme;
    return schema_of(imaging_fields(programme));
  };
  return {"imaging", "slews drawn from the seed", schema,
          [&attitude, &file](const TomlTable& table, const toml::node& node) {
            auto* programme = std::get_if<ImagingProgramme>(&attitude.slews);
            if (programme == nullptr) {
              table.refuse(node, "\"imaging\" and \"slews\" are both there", "keep one of them");
            }
            read_fields(table.as_table(node, "imaging"), file, "[attitude.imaging]", imaging_fields(*programme));
          }};
}

Fields attitude_fields(AttitudeScenario& attitude, const fs::path& file, Time epoch) {
  using Reference = AttitudeScenario::Reference;
  return {choice<Reference>("reference", attitude.reference, "attitude that slews begin from",
                            {{"orbital", Reference::kOrbital},
                             {"yaw-steered", Reference::kYawSteered},
                             {"inertial", Reference::kInertial},
                             {"recorded", Reference::kRecorded}}),
          inertial_attitude(attitude),
          recorded_attitude(attitude, file, epoch),
          slews(attitude, file),
          imaging(attitude, file),
          quantity("max_slew_rate", attitude.max_slew_rate_rad_s, kRate, limits::kBodyRate_rad_s, "of each slew"),
          quantity("max_slew_acceleration", attitude.max_slew_acceleration_rad_s2, kAcceleration, "of each slew"),
          quantity("jitter", attitude.jitter_rad, kAngle, limits::kSizeOfAngle_rad, "1-sigma about each body axis"),
          quantity("jitter_bandwidth", attitude.jitter_bandwidth_hz, kFrequency, "half-power")};
}

Fields harmonic_fields(DriftHarmonic& harmonic) {
  using Potential = DriftHarmonic::Potential;
  return {choice<Potential>("potential", harmonic.potential, "W of the drift -grad W, D of h x grad D",
                            {{"W", Potential::kW}, {"D", Potential::kD}}),
          whole("degree", harmonic.degree, limits::kHarmonicDegree, "of the spherical harmonic"),
          whole("order", harmonic.order, limits::kHarmonicOrder, "of the spherical harmonic; below zero the sines"),
          quantity("amplitude", harmonic.amplitude_rad_s, kRate, "of the drift")};
}

Fields kappa_fields(std::array<double, 7>& kappa) {
  Fields fields;
  for (std::size_t i = 0; i < kappa.size(); ++i) {
    fields.push_back(quantity(Esg7::kNames[i], kappa[i], kRate, ""));
  }
  return fields;
}

Fields mounting_change_fields(MountingChange& change) {
  return {three_quantities("mounting_step", change.step_rad, kAngle,
                           "rotation vector by which the mounting moves at once; of a gyro c axes, of a head its own"),
          signed_duration("mounting_step_at", change.step_at_s, "when it does, since the start of the pass"),
          three_quantities("mounting_rate", change.rate_rad_s, kRate, "at which the mounting turns evenly, same axes")};
}

Fields drift_fields(DriftScenario& drift, const fs::path& file) {
  return {
      section("kappa", file, "\"kappa\"", "coefficients of eq. (1); without them drawn from the seed",
              [&drift] { return kappa_fields(drift.kappa_rad_s.emplace()); }),
      quantity("prior_sigma", drift.prior_sigma_rad_s, kRate, limits::kDriftSigma_rad_s,
               "of each coefficient; the estimator is told it"),
      checked_list("harmonics", file, drift.harmonics, "drift that eq. (1) does not contain", harmonic_fields,
                   [](const DriftHarmonic& harmonic, const TomlTable& table, const toml::node& place) {
                     if (std::abs(harmonic.order) > harmonic.degree) {
                       table.refuse(
                           place,
                           fmt::format("a harmonic of degree {} has no order {}", harmonic.degree, harmonic.order),
                           fmt::format("give an order from {} to {}", -harmonic.degree, harmonic.degree));
                     }
                   }),
      quantity("outside_sigma", drift.outside_sigma_rad_s, kRate, limits::kSizeOfRate_rad_s,
               "1-sigma of all further members of degree 1 and 2, drawn from the seed"),
      quantity("coefficient_walk", drift.coefficient_walk_rad_s_sqrt_s, kRateWalk, "of each coefficient"),
      one_number("warm_up_fraction", drift.warm_up_fraction, limits::kPureNumber,
                 "by which the coefficients are larger at the start"),
      signed_duration("warm_up_time", drift.warm_up_time_s, limits::kTimeConstant_s, "in which that decays to 1/e"),
      quantity("direction_walk", drift.direction_walk_rad_sqrt_s, kRandomWalk, "of the momentum about each case axis"),
      quantity("markov_sigma", drift.markov_sigma_rad_s, kRate, limits::kSizeOfRate_rad_s,
               "1-sigma of a first-order Gauss-Markov drift about each case axis"),
      signed_duration("markov_time", drift.markov_time_s, limits::kTimeConstant_s, "its correlation time"),
      quantity("bump", drift.bump_rad_s, kRate, "largest drift of a sharp feature on the sphere of directions"),
      direction("bump_centre", drift.bump_centre,
                "where it is, case axes, of any length but 0; without it drawn from the seed"),
      quantity("bump_radius", drift.bump_radius_rad, kAngle, limits::kRadius_rad, "beyond which it is nothing"),
      quantity("hysteresis", drift.hysteresis_rad_s, kRate,
               "largest drift that depends on the side from which a direction was reached"),
      quantity("hysteresis_width", drift.hysteresis_width_rad, kAngle, limits::kHysteresisWidth_rad,
               "after which it has changed sides"),
      one_number("slew_fraction", drift.slew_fraction, limits::kPureNumber,
                 "by which the coefficients are larger in a slew"),
      signed_duration("slew_time", drift.slew_time_s, limits::kTimeConstant_s, "in which that decays to 1/e after it"),
      quantity("jump_sigma", drift.jump_sigma_rad_s, kRate, limits::kSizeOfRate_rad_s,
               "1-sigma of one jump of each coefficient"),
      signed_duration("jump_at", drift.jump_at_s, "when they jump, since the start of the pass"),
      one_number("polhode_fraction", drift.polhode_fraction, limits::kPureNumber,
                 "by which the polhode of the rotor modulates the coefficients"),
      signed_duration("polhode_period", drift.polhode_period_s, limits::kPolhodePeriod_s,
                      "of the polhode at the start of the pass"),
      one_number("polhode_period_rate", drift.polhode_period_rate, limits::kPureNumber,
                 "by which that period grows, seconds per second"),
      one_number("thermal_fraction", drift.thermal_fraction, limits::kPureNumber,
                 "by which the coefficients are larger in sunlight, smaller in the Earth's shadow"),
      signed_duration("thermal_time", drift.thermal_time_s, limits::kTimeConstant_s,
                      "in which they follow light and shadow")};
}

Fields readout_fields(ReadoutScenario& readout) {
  return {
      quantity("noise", readout.noise_rad, kAngle, limits::kSizeOfAngle_rad, "1-sigma per direction cosine, white"),
      three_quantities("bias", readout.bias_rad, kAngle, "of the direction cosines"),
      three_numbers("scale", readout.scale, limits::kPureNumber, "relative errors of scale of the direction cosines"),
      quantity("quantum", readout.quantum_rad, kAngle, limits::kSizeOfAngle_rad,
               "of the direction cosines; 0: not quantised"),
      signed_duration("latency", readout.latency_s, "a reading stamped t holds the direction at t - latency"),
      one_number("dropout_probability", readout.dropout_probability, limits::kProbability, "that a sample is NaN"),
      one_number("spike_probability", readout.spike_probability, limits::kProbability,
                 "that one direction cosine is off"),
      quantity("spike", readout.spike_rad, kAngle, limits::kSizeOfAngle_rad, "by at most so much"),
      one_number("stuck_probability", readout.stuck_probability, limits::kProbability,
                 "that a sample is the first to repeat the one before"),
      signed_duration("stuck", readout.stuck_s, limits::kStretch_s, "how long it is repeated")};
}

Fields unit_fields(GyroScenario& gyro, const fs::path& file) {
  return Fields{
             direction("start_direction_c", gyro.start_direction_c, "of the momentum, c axes, of any length but 0"),
             three_quantities("mounting_rotation_vector", gyro.mounting_rotation_vector_rad, kAngle,
                              "as designed and known"),
             three_quantities("misalignment", gyro.misalignment_rad, kAngle, "c axes; without it drawn from the seed"),
             quantity("misalignment_magnitude", gyro.misalignment_magnitude_rad, kAngle, limits::kSizeOfAngle_rad,
                      "of the one that is drawn"),
             quantity("alignment_prior_sigma", gyro.alignment_prior_sigma_rad, kAngle, limits::kAlignmentSigma_rad,
                      "1-sigma per axis; the estimator is told it"),
             section("drift", file, "[gyro.drift]", "how the momentum precesses",
                     [&gyro, &file] { return drift_fields(gyro.drift, file); }),
             section("readout", file, "[gyro.readout]", "how the direction of the momentum is read",
                     [&gyro] { return readout_fields(gyro.readout); })} +
         mounting_change_fields(gyro.mounting_change);
}

/// `unit`: of one gyro. Its tables are read after what [gyro] says of all.
Fields gyro_fields(Scenario& scenario, GyroScenario& gyro, const fs::path& file) {
  const auto units = [&gyro, &file] {
    Json several = array_of(schema_of(unit_fields(gyro, file)));
    several["minItems"] = 2;
    several["maxItems"] = kMaxGyros;
    return several;
  };
  return Fields{duration("period", scenario.gyro_period, limits::kGyroPeriod_s, "of the samples"),
                intervals("gaps", file, scenario.gyro_gaps, "without any sample"),
                {"unit", "one per gyro: what differs", units, [](const TomlTable&, const toml::node&) {}}} +
         unit_fields(gyro, file);
}

/// What a table says of a gyro. A misalignment that is told has the size that it has.
void read_gyro(const toml::table& table, const fs::path& file, const std::string& name, const Fields& fields,
               const GyroScenario& gyro) {
  read_fields(table, file, name, fields);
  if (const toml::node* size = table.get("misalignment_magnitude"); size != nullptr && gyro.misalignment_rad) {
    TomlTable(table, file, name)
        .refuse(*size, "\"misalignment_magnitude\" stands beside a \"misalignment\" of this gyro, which has its size",
                "keep one of them: the magnitude is that of a misalignment that is drawn");
  }
}

/// What [gyro] says of all gyros, and [[gyro.unit]] of each. Without units there are the two of the default.
void read_gyros(const toml::table& table, const fs::path& file, Scenario& scenario) {
  const toml::node* units = table.get("unit");
  std::vector<const toml::table*> tables;
  if (units != nullptr) {
    const TomlTable of_all(table, file, "[gyro]");
    const std::string cure = "begin the part of each gyro with [[gyro.unit]]";
    tables = tables_of(of_all, *units, "unit", cure);
    if (tables.size() < 2 || tables.size() > std::size_t{kMaxGyros}) {
      of_all.refuse(*units,
                    fmt::format("\"unit\" tells {} gyros; attitude needs two, and at most {} are handled",
                                tables.size(), kMaxGyros),
                    cure);
    }
    scenario.gyros.resize(tables.size());
  }
  for (std::size_t i = 0; i < scenario.gyros.size(); ++i) {
    GyroScenario& gyro = scenario.gyros[i];
    read_gyro(table, file, "[gyro]", gyro_fields(scenario, gyro, file), gyro);
    if (units != nullptr) {
      read_gyro(*tables[i], file, fmt::format("[[gyro.unit]] {}", i + 1), unit_fields(gyro, file), gyro);
    }
  }
}

Fields head_fields(StarTrackerScenario& head, const fs::path& file) {
  using Aberration = StarTrackerScenario::Aberration;
  return Fields{
             three_quantities("noise", head.noise_rad, kAngle, limits::kSizeOfAngle_rad,
                              "1-sigma about its x, y, z, white"),
             signed_duration("clock_offset", head.clock_offset_s, "a fix stamped t gives the attitude at t + offset"),
             one_number("clock_rate", head.clock_rate, limits::kClockRate_s_s,
                        "by which that offset grows, in seconds per second from the start of the pass on"),
             signed_duration("latency", head.latency_s, "a fix stamped t gives the attitude at t - latency"),
             three_quantities("orbital_sine", head.orbital_sine_rad, kAngle, "of the error at orbital period"),
             three_quantities("orbital_cosine", head.orbital_cosine_rad, kAngle, "of the error at orbital period"),
             three_quantities("field_error", head.field_error_rad, kAngle, limits::kSizeOfAngle_rad,
                              "1-sigma of the error that depends on where the stars stand in the field of view"),
             quantity("field_correlation", head.field_correlation_rad, kAngle, limits::kCorrelation_rad,
                      "by which the field moves until that error is another"),
             choice<Aberration>("aberration", head.aberration, "of starlight",
                                {{"corrected", Aberration::kCorrected}, {"uncorrected", Aberration::kUncorrected}}),
             quantity("sun_exclusion", head.sun_exclusion_rad, kAngle, limits::kHalfTurn_rad,
                      "no fix with the boresight nearer to the Sun's centre"),
             quantity("earth_exclusion", head.earth_exclusion_rad, kAngle, limits::kHalfTurn_rad,
                      "no fix with the boresight nearer to the Earth's limb"),
             quantity("max_rate", head.max_rate_rad_s, kRate, limits::kBodyRate_rad_s, "no fix above this body rate"),
             intervals("outages", file, head.outages, "without any fix"),
             one_number("dropout_probability", head.dropout_probability, limits::kProbability, "that a fix is missing"),
             one_number("outlier_probability", head.outlier_probability, limits::kProbability, "that a fix is wrong"),
             quantity("outlier", head.outlier_rad, kAngle, limits::kSizeOfAngle_rad, "by at most so much"),
             one_number("wrong_sign_probability", head.wrong_sign_probability, limits::kProbability,
                        "that -q is given in place of q"),
             three_quantities("inertial_step", head.inertial_step_rad, kAngle,
                              "rotation vector by which what it takes for in turns at once, in axes"),
             signed_duration("inertial_step_at", head.inertial_step_at_s,
                             "when it does, since the start of the pass")} +
         mounting_change_fields(head.mounting_change);
}

Fields further_head_fields(StarTrackerScenario& head, const fs::path& file) {
  return Fields{three_quantities("mounting_rotation_vector", head.mounting_rotation_vector_rad, kAngle,
                                 "as designed and known"),
                three_quantities("misalignment", head.misalignment_rad, kAngle, "c axes"),
                quantity("alignment_prior_sigma", head.alignment_prior_sigma_rad, kAngle, limits::kAlignmentSigma_rad,
                         "1-sigma per axis; the estimator is told it")} +
         head_fields(head, file);
}

Fields star_tracker_fields(Scenario& scenario, const fs::path& file) {
  const auto further = [&file] {
    StarTrackerScenario head;
    return array_of(schema_of(further_head_fields(head, file)));
  };
  return Fields{duration("period", scenario.star_tracker_period, limits::kStarTrackerPeriod_s, "of the fixes"),
                {"further", "further heads, each as the first in what it does not say", further,
                 [](const TomlTable&, const toml::node&) {}}} +
         head_fields(scenario.star_tracker, file);
}

/// What [star_tracker] says of all heads, and [[star_tracker.further]] of each other than the first.
void read_star_trackers(const toml::table& table, const fs::path& file, Scenario& scenario) {
  std::vector<const toml::table*> tables;
  if (const toml::node* further = table.get("further")) {
    tables = tables_of(TomlTable(table, file, "[star_tracker]"), *further, "further",
                       "begin the part of each further head with [[star_tracker.further]]");
  }
  read_fields(table, file, "[star_tracker]", star_tracker_fields(scenario, file));
  for (std::size_t i = 0; i < tables.size(); ++i) {
    StarTrackerScenario head = scenario.star_tracker;
    read_fields(*tables[i], file, fmt::format("[[star_tracker.further]] {}", i + 1), further_head_fields(head, file));
    scenario.further_star_trackers.push_back(head);
  }
}

/// Elements, or an ephemeris.
Field orbit(Scenario& scenario, const fs::path& file) {
  return checked(section("orbit", file, "[orbit]", "Kepler's motion with the secular rates of J2, or as it is told",
                         [&] { return orbit_fields(scenario.orbit, file, scenario.epoch); }),
                 [&orbit = scenario.orbit](const TomlTable& table, const toml::node& node) {
                   const toml::table& own = *node.as_table();
                   if (own.contains("ephemeris") && own.size() > 1) {
                     table.refuse(node, "\"ephemeris\" and elements of the orbit are both there", "keep one of them");
                   }
                   if (orbit.perigee_altitude_m > orbit.apogee_altitude_m) {
                     table.refuse(node,
                                  fmt::format("\"perigee_altitude\" is {:g}km, above \"apogee_altitude\", {:g}km",
                                              orbit.perigee_altitude_m / 1e3, orbit.apogee_altitude_m / 1e3),
                                  "give both, the perigee not above the apogee");
                   }
                 });
}

/// A reference that has a key of its own must have it.
Field attitude(Scenario& scenario, const fs::path& file) {
  return checked(section("attitude", file, "[attitude]", "how the spacecraft is pointed",
                         [&] { return attitude_fields(scenario.attitude, file, scenario.epoch); }),
                 [&its = scenario.attitude](const TomlTable& table, const toml::node& node) {
                   using Reference = AttitudeScenario::Reference;
                   const toml::table& own = *node.as_table();
                   for (const auto& [reference, key, form] :
                        {std::tuple{Reference::kInertial, "inertial_q_in_c", "[q_x, q_y, q_z, q_w]"},
                         std::tuple{Reference::kRecorded, "recorded", "\"attitude.csv\""}}) {
                     if (its.reference == reference && !own.contains(key)) {
                       table.refuse(*own.get("reference"),
                                    fmt::format("this reference needs \"{}\", which is missing", key),
                                    fmt::format("add {} = {}", key, form));
                     }
                   }
                   if (its.jitter_rad > 0 && !(its.jitter_bandwidth_hz > 0)) {
                     table.refuse(*own.get("jitter_bandwidth"), "\"jitter_bandwidth\" is zero where there is jitter",
                                  "give a frequency, or jitter = \"0deg\"");
                   }
                 });
}

/// In this order: what is read from other files needs the epoch.
Fields file_fields(Scenario& scenario, const fs::path& file) {
  const auto gyro = [&scenario, &file] { return schema_of(gyro_fields(scenario, scenario.gyros.front(), file)); };
  const auto star_tracker = [&scenario, &file] { return schema_of(star_tracker_fields(scenario, file)); };
  return {section("scenario", file, "[scenario]", "the pass", [&] { return scenario_fields(scenario); }),
          orbit(scenario, file),
          attitude(scenario, file),
          {"gyro", "of all gyros", gyro,
           [&](const TomlTable& table, const toml::node& node) {
             read_gyros(table.as_table(node, "gyro"), file, scenario);
           }},
          {"star_tracker", "the first head; its axes are c", star_tracker,
           [&](const TomlTable& table, const toml::node& node) {
             read_star_trackers(table.as_table(node, "star_tracker"), file, scenario);
           }}};
}

}  // namespace

Scenario scenario_of_table(const toml::table& table, const fs::path& file, const std::string& name) {
  Scenario scenario;
  read_fields(table, file, name, file_fields(scenario, file));
  return scenario;
}

Scenario parse_scenario(std::string_view text, const fs::path& file) {
  return scenario_of_table(parse_toml(text, file), file, "the file");
}

Scenario read_scenario(const fs::path& file) {
  const TextFile content(file);
  return parse_scenario(content.text(), file);
}

std::vector<fs::path> files_of_scenario(const fs::path& scenario_file) {
  const TextFile content(scenario_file);
  const toml::table document = parse_toml(content.text(), scenario_file);
  std::vector<fs::path> files;
  for (const auto& name :
       {document["attitude"]["recorded"].value<std::string>(), document["orbit"]["ephemeris"].value<std::string>()}) {
    if (name) {
      files.push_back(scenario_file.parent_path() / *name);
    }
  }
  return files;
}

Json scenario_table_schema() {
  Scenario scenario;
  const fs::path file;
  return schema_of(file_fields(scenario, file));
}

Json scenario_schema() {
  return toml_file_schema("Scenario",
                          "What a simulated pass is made of (TOML). What is left out keeps its default, which is the "
                          "paper's experiment.",
                          scenario_table_schema());
}

}  // namespace trihedron::io
