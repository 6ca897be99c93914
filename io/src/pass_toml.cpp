#include "pass_toml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "screening.hpp"
#include "toml_table.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeadNoise = "noise_rad";
constexpr std::string_view kMounting = "mounting_rotation_vector_rad";
constexpr std::string_view kStartUp = "start_up";
constexpr std::string_view kNoise = "readout_noise_rad";
constexpr std::string_view kDrift = "drift_prior_rad_s";
constexpr std::string_view kDriftSigma = "drift_prior_sigma_rad_s";
constexpr std::string_view kAlignment = "alignment_prior_rotation_vector_rad";
constexpr std::string_view kAlignmentSigma = "alignment_prior_sigma_rad";

Duration duration_at(const TomlTable& table, std::string_view key, const Range& range) {
  return from_seconds(table.number(table.at(key), key, range));
}

Time parse_epoch_node(const TomlTable& table, std::string_view key) {
  const toml::node& node = table.at(key);
  std::string text;
  if (const auto* local = node.as_date_time(); local != nullptr && !local->get().offset) {
    std::ostringstream stream;
    stream << local->get();
    text = stream.str();
  } else {
    text = table.text(node, key);
  }
  const std::optional<Time> epoch = parse_epoch(text);
  if (!epoch) {
    table.refuse(node, fmt::format("\"{}\" is {}, not an ISO date and time", key, in_quotes(text)),
                 "write it like \"2009-05-20T00:00:00\", TAI, years 1958 to 2200, without time zone");
  }
  return *epoch;
}

/// A table by drift coefficient.
std::map<DriftCoefficient, double> by_coefficient(const TomlTable& parent, const toml::node& node, std::string_view key,
                                                  const fs::path& file, const Range& range) {
  const std::vector<std::string_view> known(Esg7::kNames.begin(), Esg7::kNames.end());
  const TomlTable table(parent.as_table(node, key), file, std::string(key), known);
  std::map<DriftCoefficient, double> values;
  for (int i = 0; i < Esg7::kSize; ++i) {
    const char* name = Esg7::kNames.at(static_cast<std::size_t>(i));
    if (const toml::node* value = table.find(name)) {
      values[DriftCoefficient::of_eq1(i)] = table.number(*value, name, range);
    }
  }
  return values;
}

/// What the keys of [gyro] or of one [[gyro.unit]] say of a gyro, over what is known already.
void read_prior(const TomlTable& table, const fs::path& file, GyroPrior& prior) {
  if (const toml::node* node = table.find(kNoise)) {
    prior.readout_noise_rad = table.number(*node, kNoise, limits::kReadoutNoise_rad);
  }
  if (const toml::node* node = table.find(kDrift)) {
    prior.drift_rad_s = by_coefficient(table, *node, kDrift, file, limits::kDrift_rad_s);
  }
  if (const toml::node* node = table.find(kDriftSigma)) {
    if (node->is_table()) {
      prior.drift_sigma_rad_s = by_coefficient(table, *node, kDriftSigma, file, limits::kDriftSigma_rad_s);
    } else {
      prior.drift_common_sigma_rad_s = table.number(*node, kDriftSigma, limits::kDriftSigma_rad_s);
    }
  }
  if (const toml::node* node = table.find(kAlignment)) {
    prior.alignment_rotation_vector_rad = table.three_numbers(*node, kAlignment, limits::kRotation_rad);
  }
  if (const toml::node* node = table.find(kAlignmentSigma)) {
    constexpr const Range& kRange = limits::kAlignmentSigma_rad;
    prior.alignment_sigma_rad = node->is_array()
                                    ? table.three_numbers(*node, kAlignmentSigma, kRange)
                                    : Eigen::Vector3d::Constant(table.number(*node, kAlignmentSigma, kRange));
  }
}

std::vector<FurtherStarTracker> read_further_star_trackers(const TomlTable& table, const fs::path& file) {
  std::vector<FurtherStarTracker> heads;
  const toml::node* further = table.find("further");
  if (further == nullptr) {
    return heads;
  }
  const toml::array* array = further->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    table.refuse(*further, "\"further\" is not an array of tables",
                 "begin the part of each further head with [[star_tracker.further]]");
  }
  for (const toml::node& element : *array) {
    const TomlTable head(*element.as_table(), file, fmt::format("[[star_tracker.further]] {}", heads.size() + 1),
                         {kHeadNoise, kMounting, kAlignmentSigma});
    heads.push_back({head.three_numbers(head.at(kHeadNoise), kHeadNoise, limits::kStarTrackerNoise_rad),
                     head.three_numbers(head.at(kMounting), kMounting, limits::kRotation_rad),
                     head.number(head.at(kAlignmentSigma), kAlignmentSigma, limits::kAlignmentSigma_rad)});
  }
  return heads;
}

std::vector<GyroPrior> read_gyros(const TomlTable& table, const fs::path& file, int gyros) {
  for (const std::string_view key : {kNoise, kDriftSigma, kAlignmentSigma}) {
    static_cast<void>(table.at(key));
  }
  GyroPrior common;
  if (const toml::node& node = table.at(kDriftSigma); node.is_table()) {
    table.refuse(node, fmt::format("\"{}\" is a table", kDriftSigma),
                 "in [gyro] give one number; a table by coefficient belongs in [[gyro.unit]]");
  }
  read_prior(table, file, common);
  std::vector<GyroPrior> priors(static_cast<std::size_t>(gyros), common);
  const toml::node* units = table.find("unit");
  if (units == nullptr) {
    return priors;
  }
  const toml::array* array = units->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    table.refuse(*units, "\"unit\" is not an array of tables", "begin the part of each gyro with [[gyro.unit]]");
  }
  if (array->size() != priors.size()) {
    table.refuse(*units,
                 fmt::format("[[gyro.unit]] is there {} times, the telemetry has {} gyros", array->size(), gyros),
                 "give one per gyro, in their order");
  }
  for (std::size_t i = 0; i < priors.size(); ++i) {
    const TomlTable unit(*(*array)[i].as_table(), file, fmt::format("[[gyro.unit]] {}", i + 1),
                         {kNoise, kDrift, kDriftSigma, kAlignment, kAlignmentSigma});
    read_prior(unit, file, priors[i]);
  }
  return priors;
}

std::string format_three(const Eigen::Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

std::string format_sigmas(const Eigen::Vector3d& v) {
  return v.x() == v.y() && v.x() == v.z() ? fmt::to_string(v.x()) : format_three(v);
}

/// Whether a gyro needs its own [[gyro.unit]] because it differs from the common values in [gyro].
bool differs(const GyroPrior& gyro, const GyroPrior& common) {
  return !gyro.drift_rad_s.empty() || !gyro.drift_sigma_rad_s.empty() ||
         !gyro.alignment_rotation_vector_rad.isZero(0) || gyro.readout_noise_rad != common.readout_noise_rad ||
         gyro.drift_common_sigma_rad_s != common.drift_common_sigma_rad_s ||
         gyro.alignment_sigma_rad != common.alignment_sigma_rad;
}

std::string format_text(const std::string& text) {
  std::ostringstream stream;
  stream << toml::value<std::string>(text);
  return stream.str();
}

std::string format_map(const std::map<DriftCoefficient, double>& values) {
  std::string text;
  for (const auto& [coefficient, value] : values) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", name_of(coefficient), value);
  }
  return "{" + text + "}";
}

/// The [[gyro.unit]] of one gyro.
std::string format_unit(const GyroPrior& gyro, const GyroPrior& common) {
  std::string text =
      fmt::format("\n[[gyro.unit]]\n{} = {}\n{} = {}\n{} = {}\n{} = {}\n", kNoise, gyro.readout_noise_rad, kDrift,
                  format_map(gyro.drift_rad_s), kAlignment, format_three(gyro.alignment_rotation_vector_rad),
                  kAlignmentSigma, format_sigmas(gyro.alignment_sigma_rad));
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

TomlTable root_table(const toml::table& document, const fs::path& file) {
  return {document, file, "the file", {"pass", "gyro", "star_tracker", "prior"}};
}

TomlTable pass_table(const TomlTable& root, const fs::path& file) {
  return {root.table_at("pass"), file, "[pass]", {"spacecraft", "epoch_tai", "duration_s", "prior"}};
}

}  // namespace

Time parse_pass_epoch(std::string_view text, const fs::path& file) {
  const toml::table document = parse_toml(text, file);
  return parse_epoch_node(pass_table(root_table(document, file), file), "epoch_tai");
}

PassSettings parse_pass_toml(std::string_view text, const fs::path& file, const fs::path& directory, int gyros) {
  const toml::table document = parse_toml(text, file);
  const TomlTable root = root_table(document, file);
  const TomlTable pass = pass_table(root, file);
  const TomlTable gyro(root.table_at("gyro"), file, "[gyro]",
                       {"period_s", kStartUp, kNoise, kDriftSigma, kAlignmentSigma, "unit"});
  const TomlTable star_tracker(root.table_at("star_tracker"), file, "[star_tracker]",
                               {"period_s", kHeadNoise, "further"});

  PassSettings settings;
  settings.spacecraft = pass.text(pass.at("spacecraft"), "spacecraft");
  settings.epoch = parse_epoch_node(pass, "epoch_tai");
  settings.duration = duration_at(pass, "duration_s", limits::kPassDuration_s);
  settings.gyro_period = duration_at(gyro, "period_s", limits::kGyroPeriod_s);
  settings.star_tracker_period = duration_at(star_tracker, "period_s", limits::kStarTrackerPeriod_s);
  settings.star_tracker_noise_rad =
      star_tracker.three_numbers(star_tracker.at(kHeadNoise), kHeadNoise, limits::kStarTrackerNoise_rad);
  settings.further_star_trackers = read_further_star_trackers(star_tracker, file);
  settings.gyros = read_gyros(gyro, file, gyros);
  if (const toml::node* start_up = gyro.find(kStartUp)) {
    settings.start_up = gyro.text(*start_up, kStartUp);
  }

  const bool at_root = root.find("prior") != nullptr;
  const TomlTable& holder = at_root ? root : pass;
  if (const toml::node* prior = holder.find("prior")) {
    if (at_root && pass.find("prior") != nullptr) {
      root.refuse(*prior, "\"prior\" is there twice", "keep the one in [pass]");
    }
    const fs::path prior_file = directory / holder.text(*prior, "prior");
    settings.prior = read_calibration(prior_file);
    check_prior(*settings.prior, prior_file, gyros);
  }
  return settings;
}

void check_prior(const Calibration& prior, const fs::path& prior_file, int gyros) {
  if (prior.gyros.size() != static_cast<std::size_t>(gyros)) {
    throw InputRefused(prior_file, {},
                       fmt::format("has {} gyros, the telemetry of the pass has {}", prior.gyros.size(), gyros),
                       "give a calibration of the same gyros as prior");
  }
}

std::string format_pass_toml(const PassSettings& settings, std::string_view prior_file) {
  const GyroPrior common = settings.gyros.empty() ? GyroPrior{} : settings.gyros.front();
  std::string text =
      fmt::format("# One pass of telemetry.\n[pass]\nspacecraft = {}\nepoch_tai = \"{}\"\nduration_s = {}\n",
                  format_text(settings.spacecraft), format_epoch(settings.epoch), format_seconds(settings.duration));
  if (!prior_file.empty()) {
    text += fmt::format("prior = \"{}\"\n", prior_file);
  }
  text +=
      fmt::format("\n[gyro]\n{}period_s = {}\n{} = {}  # 1-sigma per direction cosine\n{} = {}\n{} = {}\n",
                  settings.start_up.empty() ? "" : fmt::format("{} = {}\n", kStartUp, format_text(settings.start_up)),
                  format_seconds(settings.gyro_period), kNoise, common.readout_noise_rad, kDriftSigma,
                  common.drift_common_sigma_rad_s, kAlignmentSigma, format_sigmas(common.alignment_sigma_rad));
  if (std::ranges::any_of(settings.gyros, [&](const GyroPrior& gyro) { return differs(gyro, common); })) {
    for (const GyroPrior& gyro : settings.gyros) {
      text += format_unit(gyro, common);
    }
  }
  text += fmt::format("\n[star_tracker]\nperiod_s = {}\n{} = {}  # 1-sigma about c x, y, z\n",
                      format_seconds(settings.star_tracker_period), kHeadNoise,
                      format_three(settings.star_tracker_noise_rad));
  for (const FurtherStarTracker& head : settings.further_star_trackers) {
    text += fmt::format("\n[[star_tracker.further]]\n{} = {}  # about its own axes\n{} = {}\n{} = {}\n", kHeadNoise,
                        format_three(head.noise_rad), kMounting, format_three(head.mounting_rotation_vector_rad),
                        kAlignmentSigma, head.alignment_prior_sigma_rad);
  }
  return text;
}

}  // namespace trihedron::io
