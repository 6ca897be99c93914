#include "pass_toml.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <sstream>
#include <utility>

#include "ccsds_frames.hpp"
#include "schemas.hpp"
#include "screening.hpp"
#include "toml_fields.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeadNoise = "noise_rad";
constexpr std::string_view kMounting = "mounting_rotation_vector_rad";
constexpr std::string_view kInertialFrame = "inertial_frame";
constexpr std::string_view kClockOffset = "clock_offset_s";
constexpr std::string_view kClockRate = "clock_rate_s_s";
constexpr std::string_view kLatency = "latency_s";
constexpr std::string_view kStartUp = "start_up";
constexpr std::string_view kNoise = "readout_noise_rad";
constexpr std::string_view kDrift = "drift_prior_rad_s";
constexpr std::string_view kDriftSigma = "drift_prior_sigma_rad_s";
constexpr std::string_view kAlignment = "alignment_prior_rotation_vector_rad";
constexpr std::string_view kAlignmentSigma = "alignment_prior_sigma_rad";

/// A table by drift coefficient.
Fields coefficient_fields(std::map<DriftCoefficient, double>& values, const Range& range) {
  Fields fields;
  for (int i = 0; i < Esg7::kSize; ++i) {
    const std::string_view name = Esg7::kNames.at(static_cast<std::size_t>(i));
    fields.push_back({name, "", [range] { return number_schema(range); },
                      [=, &values](const TomlTable& table, const toml::node& node) {
                        values[DriftCoefficient::of_eq1(i)] = table.number(node, name, range);
                      }});
  }
  return fields;
}

Field drift_sigma(GyroPrior& prior) {
  return one_number(kDriftSigma, prior.drift_common_sigma_rad_s, limits::kDriftSigma_rad_s,
                    "1-sigma of each drift coefficient");
}

/// One number, or a table by coefficient.
Field drift_sigmas(GyroPrior& prior, const fs::path& file) {
  const auto schema = [&prior] {
    return any_of({number_schema(limits::kDriftSigma_rad_s),
                   schema_of(coefficient_fields(prior.drift_sigma_rad_s, limits::kDriftSigma_rad_s))});
  };
  return {kDriftSigma, "1-sigma of each drift coefficient, or by coefficient", schema,
          [&prior, &file](const TomlTable& table, const toml::node& node) {
            if (node.is_table()) {
              read_fields(table.as_table(node, kDriftSigma), file, std::string(kDriftSigma),
                          coefficient_fields(prior.drift_sigma_rad_s, limits::kDriftSigma_rad_s));
            } else {
              drift_sigma(prior).read(table, node);
            }
          }};
}

/// One number, or three about c x, y, z.
Field alignment_sigma(GyroPrior& prior) {
  const auto schema = [] {
    return any_of({number_schema(limits::kAlignmentSigma_rad), three_of(number_schema(limits::kAlignmentSigma_rad))});
  };
  return {kAlignmentSigma, "1-sigma of the alignment, or about each axis", schema,
          [&prior](const TomlTable& table, const toml::node& node) {
            prior.alignment_sigma_rad =
                node.is_array()
                    ? table.three_numbers(node, kAlignmentSigma, limits::kAlignmentSigma_rad)
                    : Eigen::Vector3d::Constant(table.number(node, kAlignmentSigma, limits::kAlignmentSigma_rad));
          }};
}

Field readout_noise(GyroPrior& prior) {
  return one_number(kNoise, prior.readout_noise_rad, limits::kReadoutNoise_rad, "1-sigma per direction cosine");
}

Fields unit_fields(GyroPrior& prior, const fs::path& file) {
  return {readout_noise(prior),
          section(kDrift, file, std::string(kDrift), "drift coefficients known before the pass",
                  [&prior] { return coefficient_fields(prior.drift_rad_s, limits::kDrift_rad_s); }),
          drift_sigmas(prior, file),
          three_numbers(kAlignment, prior.alignment_rotation_vector_rad, limits::kRotation_rad,
                        "alignment known before the pass"),
          alignment_sigma(prior),
          one_number(kLatency, prior.latency_s, limits::kLatency_s,
                     "by which its readings are stamped late; they are interpolated when the pass is read"),
          three_numbers(kMounting, prior.mounting_rotation_vector_rad, limits::kRotation_rad,
                        "of its case in the body, as designed: v_body = exp([m×]) v_case; instead of the alignment")};
}

/// What [[gyro.unit]] says of each gyro, over what is known of all.
Field units(std::vector<GyroPrior>& gyros, const fs::path& file) {
  const auto schema = [&file] {
    GyroPrior prior;
    return array_of(schema_of(unit_fields(prior, file)));
  };
  return {
      "unit", "one per gyro: what differs", schema, [&gyros, &file](const TomlTable& table, const toml::node& node) {
        const auto tables = tables_of(table, node, "unit", "begin the part of each gyro with [[gyro.unit]]");
        if (tables.size() != gyros.size()) {
          table.refuse(
              node,
              fmt::format("[[gyro.unit]] is there {} times, the telemetry has {} gyros", tables.size(), gyros.size()),
              "give one per gyro, in their order");
        }
        for (std::size_t i = 0; i < gyros.size(); ++i) {
          read_fields(*tables[i], file, fmt::format("[[gyro.unit]] {}", i + 1), unit_fields(gyros[i], file));
          if (gyros[i].mounting_rotation_vector_rad && tables[i]->contains(kAlignment)) {
            table.refuse(
                *tables[i]->get(kAlignment),
                fmt::format("\"{}\" and \"{}\" are both there, and each gives the alignment", kAlignment, kMounting),
                "keep one of them");
          }
        }
      }};
}

/// Whether what the telemetry shows may be left out.
enum class Told { kAll, kOrMeasured };

Field told_or_measured(Field field, Told told) {
  field.is_required = told == Told::kAll;
  return field;
}

/// `common`: of all gyros. What [[gyro.unit]] says of each is read after it.
Fields gyro_fields(PassSettings& settings, GyroPrior& common, const fs::path& file, Told told) {
  Field sigma = drift_sigma(common);
  sigma.read = [&common](const TomlTable& table, const toml::node& node) {
    if (node.is_table()) {
      table.refuse(node, fmt::format("\"{}\" is a table", kDriftSigma),
                   "in [gyro] give one number; a table by coefficient belongs in [[gyro.unit]]");
    }
    drift_sigma(common).read(table, node);
  };
  Field unit = units(settings.gyros, file);
  unit.read = [](const TomlTable&, const toml::node&) {};
  return {told_or_measured(number_of_seconds("period_s", settings.gyro_period, limits::kGyroPeriod_s, "of the samples"),
                           told),
          text(kStartUp, settings.start_up, "of the rotors, where it is known"),
          required(readout_noise(common)),
          required(std::move(sigma)),
          required(alignment_sigma(common)),
          std::move(unit)};
}

Field gyros(PassSettings& settings, const fs::path& file, Told told) {
  const auto schema = [&settings, &file, told] {
    GyroPrior common;
    return schema_of(gyro_fields(settings, common, file, told));
  };
  return {"gyro", "of all gyros", schema, [&settings, &file, told](const TomlTable& root, const toml::node& node) {
            const toml::table& table = root.as_table(node, "gyro");
            GyroPrior common;
            read_fields(table, file, "[gyro]", gyro_fields(settings, common, file, told));
            std::ranges::fill(settings.gyros, common);
            if (const toml::node* unit = table.get("unit")) {
              units(settings.gyros, file).read(TomlTable(table, file, "[gyro]"), *unit);
            }
          }};
}

Fields further_head_fields(FurtherStarTracker& head) {
  return {
      required(three_numbers(kHeadNoise, head.noise_rad, limits::kStarTrackerNoise_rad, "1-sigma about its x, y, z")),
      required(three_numbers(kMounting, head.mounting_rotation_vector_rad, limits::kRotation_rad, "as designed")),
      required(one_number(kAlignmentSigma, head.alignment_prior_sigma_rad, limits::kAlignmentSigma_rad,
                          "1-sigma per axis"))};
}

Field further_heads(PassSettings& settings, const fs::path& file) {
  const auto schema = [] {
    FurtherStarTracker head;
    return array_of(schema_of(further_head_fields(head)));
  };
  return {
      "further", "further heads", schema, [&settings, &file](const TomlTable& table, const toml::node& node) {
        settings.further_star_trackers.clear();
        for (const toml::table* element :
             tables_of(table, node, "further", "begin the part of each further head with [[star_tracker.further]]")) {
          FurtherStarTracker& head = settings.further_star_trackers.emplace_back();
          read_fields(*element, file, fmt::format("[[star_tracker.further]] {}", settings.further_star_trackers.size()),
                      further_head_fields(head));
        }
      }};
}

Fields star_tracker_fields(PassSettings& settings, const fs::path& file, Told told) {
  return {told_or_measured(
              number_of_seconds("period_s", settings.star_tracker_period, limits::kStarTrackerPeriod_s, "of the fixes"),
              told),
          told_or_measured(three_numbers(kHeadNoise, settings.star_tracker_noise_rad, limits::kStarTrackerNoise_rad,
                                         "1-sigma about c x, y, z"),
                           told),
          three_numbers(kMounting, settings.star_tracker_mounting_rotation_vector_rad, limits::kRotation_rad,
                        "of the first head in the body, as designed: v_body = exp([m×]) v_c"),
          one_number(kClockOffset, settings.star_tracker_clock_offset_s, limits::kClockOffset_s,
                     "a fix stamped t gives the attitude at t + offset; stamps are corrected when the pass is read"),
          one_number(kClockRate, settings.star_tracker_clock_rate_s_s, limits::kClockRate_s_s,
                     "by which that offset grows from the epoch on"),
          further_heads(settings, file)};
}

/// An earlier calibration, in [pass] or before it.
Field prior(std::optional<std::string>& found) {
  return {"prior", "calibration.json of an earlier pass, beside this file", text_schema,
          [&found](const TomlTable& table, const toml::node& node) {
            if (found) {
              table.refuse(node, "\"prior\" is there twice", "keep the one in [pass]");
            }
            found = table.text(node, "prior");
          }};
}

/// One that is known to be inertial.
Field inertial_frame(std::string& target) {
  return {kInertialFrame, "name of the axes that the fixes refer to: GCRF, EME2000 …", text_schema,
          [&target](const TomlTable& table, const toml::node& node) {
            target = table.text(node, kInertialFrame);
            if (!is_inertial_frame(normalised(target))) {
              table.refuse(
                  node, fmt::format("\"{}\" is {}, no inertial frame that is known", kInertialFrame, in_quotes(target)),
                  "give ICRF, GCRF or EME2000; turn the attitude where it refers to other axes");
            }
          }};
}

Fields pass_fields(PassSettings& settings, std::optional<std::string>& prior_file, Told told) {
  return {required(text("spacecraft", settings.spacecraft, "its name")),
          told_or_measured(epoch("epoch_tai", settings.epoch, "start of the pass, TAI"), told),
          told_or_measured(number_of_seconds("duration_s", settings.duration, limits::kPassDuration_s, "of the pass"),
                           told),
          inertial_frame(settings.inertial_frame), prior(prior_file)};
}

Fields file_fields(PassSettings& settings, std::optional<std::string>& prior_file, const fs::path& file, Told told) {
  return {
      required(section("pass", file, "[pass]", "when", [&, told] { return pass_fields(settings, prior_file, told); })),
      prior(prior_file), required(gyros(settings, file, told)),
      required(section("star_tracker", file, "[star_tracker]", "of the first head",
                       [&, told] { return star_tracker_fields(settings, file, told); }))};
}

/// The alignment of each gyro of which the mounting in the body is told: C_c_b = C_body_cᵀ C_body_b.
void align_by_mounting(PassSettings& settings, const fs::path& file) {
  const auto turned = [](const Eigen::Vector3d& vector) -> Eigen::Quaterniond {
    const double angle = vector.norm();
    return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle)) : Eigen::Quaterniond::Identity();
  };
  for (std::size_t k = 0; k < settings.gyros.size(); ++k) {
    GyroPrior& gyro = settings.gyros[k];
    if (!gyro.mounting_rotation_vector_rad) {
      continue;
    }
    if (!settings.star_tracker_mounting_rotation_vector_rad) {
      throw InputRefused(file, {},
                         fmt::format("[[gyro.unit]] {} has \"{}\", and [star_tracker] has none", k + 1, kMounting),
                         "give that of the star tracker as well: the alignment is between the two");
    }
    const Eigen::AngleAxisd c_b(turned(*settings.star_tracker_mounting_rotation_vector_rad).conjugate() *
                                turned(*gyro.mounting_rotation_vector_rad));
    gyro.alignment_rotation_vector_rad = c_b.angle() * c_b.axis();
  }
}

SettingsOfTelemetry read_pass_settings(const toml::table& document, const fs::path& file, const fs::path& directory,
                                       int gyros, Told told, const Fields& more) {
  PassSettings settings;
  settings.gyros.resize(static_cast<std::size_t>(gyros));
  std::optional<std::string> prior_name;
  read_fields(document, file, "the file", file_fields(settings, prior_name, file, told) + more);
  align_by_mounting(settings, file);
  fs::path prior_file;
  if (prior_name) {
    prior_file = directory / *prior_name;
    settings.prior = read_calibration(prior_file);
    check_prior(*settings.prior, prior_file, gyros);
  }
  return {std::move(settings), std::move(prior_file)};
}

std::string format_three(const Eigen::Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

std::string format_sigmas(const Eigen::Vector3d& v) {
  return v.x() == v.y() && v.x() == v.z() ? fmt::to_string(v.x()) : format_three(v);
}

/// Whether a gyro needs its own [[gyro.unit]] because it differs from the common values in [gyro].
bool differs(const GyroPrior& gyro, const GyroPrior& common, TelemetryStamps stamps) {
  return (stamps == TelemetryStamps::kAsReceived && gyro.latency_s != 0) || !gyro.drift_rad_s.empty() ||
         !gyro.drift_sigma_rad_s.empty() || !gyro.alignment_rotation_vector_rad.isZero(0) ||
         gyro.readout_noise_rad != common.readout_noise_rad ||
         gyro.drift_common_sigma_rad_s != common.drift_common_sigma_rad_s ||
         gyro.alignment_sigma_rad != common.alignment_sigma_rad;
}

std::string format_map(const std::map<DriftCoefficient, double>& values) {
  std::string text;
  for (const auto& [coefficient, value] : values) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", name_of(coefficient), value);
  }
  return "{" + text + "}";
}

/// How far stamps are off: nothing where they are not.
std::string format_clock(std::string_view key, double value, TelemetryStamps stamps) {
  return stamps == TelemetryStamps::kCorrected || value == 0 ? "" : fmt::format("{} = {}\n", key, value);
}

/// The [[gyro.unit]] of one gyro.
std::string format_unit(const GyroPrior& gyro, const GyroPrior& common, TelemetryStamps stamps) {
  std::string text =
      fmt::format("\n[[gyro.unit]]\n{} = {}\n{} = {}\n{} = {}\n{} = {}\n", kNoise, gyro.readout_noise_rad, kDrift,
                  format_map(gyro.drift_rad_s), kAlignment, format_three(gyro.alignment_rotation_vector_rad),
                  kAlignmentSigma, format_sigmas(gyro.alignment_sigma_rad)) +
      format_clock(kLatency, gyro.latency_s, stamps);
  if (gyro.drift_sigma_rad_s.empty()) {
    return text + fmt::format("{} = {}\n", kDriftSigma, gyro.drift_common_sigma_rad_s);
  }
  // What a table leaves out has the sigma of [gyro]: where this gyro's own differs, name it for each coefficient.
  std::map<DriftCoefficient, double> sigmas = gyro.drift_sigma_rad_s;
  if (gyro.drift_common_sigma_rad_s != common.drift_common_sigma_rad_s) {
    for (const DriftCoefficient& coefficient : coefficients_of(kEsg7)) {
      sigmas.emplace(coefficient, gyro.drift_common_sigma_rad_s);
    }
  }
  return text + fmt::format("{} = {}\n", kDriftSigma, format_map(sigmas));
}

}  // namespace

Time parse_pass_epoch(std::string_view text, const fs::path& file) {
  const toml::table document = parse_toml(text, file);
  const TomlTable root(document, file, "the file");
  PassSettings settings;
  std::optional<std::string> prior_name;
  read_fields(root.table_at("pass"), file, "[pass]", pass_fields(settings, prior_name, Told::kAll));
  return settings.epoch;
}

fs::path parse_prior_file(std::string_view text, const fs::path& file, const fs::path& directory) {
  const toml::table document = parse_toml(text, file);
  const TomlTable root(document, file, "the file");
  PassSettings settings;
  std::optional<std::string> prior_name;
  if (const toml::node* const at_root = root.find("prior")) {
    prior(prior_name).read(root, *at_root);
  }
  read_fields(root.table_at("pass"), file, "[pass]", pass_fields(settings, prior_name, Told::kAll));
  return prior_name ? directory / *prior_name : fs::path();
}

PassSettings parse_pass_toml(std::string_view text, const fs::path& file, const fs::path& directory, int gyros) {
  return read_pass_settings(parse_toml(text, file), file, directory, gyros, Told::kAll, {}).settings;
}

SettingsOfTelemetry read_telemetry_settings(const toml::table& document, const fs::path& file,
                                            const fs::path& directory, int gyros, const Field& telemetry) {
  return read_pass_settings(document, file, directory, gyros, Told::kOrMeasured, {telemetry});
}

Fields telemetry_settings_fields(PassSettings& settings, std::optional<std::string>& prior_name, const fs::path& file) {
  return file_fields(settings, prior_name, file, Told::kOrMeasured);
}

Json pass_schema() {
  PassSettings settings;
  std::optional<std::string> prior_name;
  const fs::path file;
  return toml_file_schema("Pass", "pass.toml: when and how the telemetry was taken, and what is known before.",
                          schema_of(file_fields(settings, prior_name, file, Told::kAll)));
}

void check_prior(const Calibration& prior, const fs::path& prior_file, int gyros) {
  if (prior.gyros.size() != static_cast<std::size_t>(gyros)) {
    throw InputRefused(prior_file, {},
                       fmt::format("has {} gyros, the telemetry of the pass has {}", prior.gyros.size(), gyros),
                       "give a calibration of the same gyros as prior");
  }
}

std::string format_text(const std::string& text) {
  // In double quotes, as strings are written in all documents.
  constexpr auto kFlags = toml::toml_formatter::default_flags & ~toml::format_flags::allow_literal_strings;
  const toml::value<std::string> value(text);
  std::ostringstream stream;
  stream << toml::toml_formatter(value, kFlags);
  return stream.str();
}

std::string format_pass_toml(const PassSettings& settings, std::string_view prior_file, TelemetryStamps stamps) {
  const GyroPrior common = settings.gyros.empty() ? GyroPrior{} : settings.gyros.front();
  std::string text =
      fmt::format("# One pass of telemetry.\n{} = {}\n\n[pass]\nspacecraft = {}\nepoch_tai = \"{}\"\nduration_s = {}\n",
                  kVersionKey, kTomlVersion, format_text(settings.spacecraft), format_epoch(settings.epoch),
                  format_seconds(settings.duration));
  if (!settings.inertial_frame.empty()) {
    text += fmt::format("{} = {}\n", kInertialFrame, format_text(settings.inertial_frame));
  }
  if (!prior_file.empty()) {
    text += fmt::format("prior = {}\n", format_text(std::string(prior_file)));
  }
  text +=
      fmt::format("\n[gyro]\n{}period_s = {}\n{} = {}  # 1-sigma per direction cosine\n{} = {}\n{} = {}\n",
                  settings.start_up.empty() ? "" : fmt::format("{} = {}\n", kStartUp, format_text(settings.start_up)),
                  format_seconds(settings.gyro_period), kNoise, common.readout_noise_rad, kDriftSigma,
                  common.drift_common_sigma_rad_s, kAlignmentSigma, format_sigmas(common.alignment_sigma_rad));
  if (std::ranges::any_of(settings.gyros, [&](const GyroPrior& gyro) { return differs(gyro, common, stamps); })) {
    for (const GyroPrior& gyro : settings.gyros) {
      text += format_unit(gyro, common, stamps);
    }
  }
  text += fmt::format("\n[star_tracker]\nperiod_s = {}\n{} = {}  # 1-sigma about c x, y, z\n",
                      format_seconds(settings.star_tracker_period), kHeadNoise,
                      format_three(settings.star_tracker_noise_rad));
  if (settings.star_tracker_mounting_rotation_vector_rad) {
    text += fmt::format("{} = {}  # in the body\n", kMounting,
                        format_three(*settings.star_tracker_mounting_rotation_vector_rad));
  }
  text += format_clock(kClockOffset, settings.star_tracker_clock_offset_s, stamps) +
          format_clock(kClockRate, settings.star_tracker_clock_rate_s_s, stamps);
  for (const FurtherStarTracker& head : settings.further_star_trackers) {
    text += fmt::format("\n[[star_tracker.further]]\n{} = {}  # about its own axes\n{} = {}\n{} = {}\n", kHeadNoise,
                        format_three(head.noise_rad), kMounting, format_three(head.mounting_rotation_vector_rad),
                        kAlignmentSigma, head.alignment_prior_sigma_rad);
  }
  return text;
}

}  // namespace trihedron::io
