#include "trihedron/io/pass.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <system_error>
#include <utility>

#include "csv.hpp"
#include "input_formats.hpp"
#include "netcdf_file.hpp"
#include "netcdf_input.hpp"
#include "pass_toml.hpp"
#include "screening.hpp"
#include "selection.hpp"
#include "text_file.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/staged_directory.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/clocks.hpp"
#include "trihedron/records/stop.hpp"
#include "truth.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

// Names in a directory.
constexpr const char* kSettingsFile = "pass.toml";
constexpr const char* kGyroFile = "gyro.csv";
constexpr const char* kTruthFile = "truth.csv";
constexpr const char* kTruthParametersFile = "truth.json";
constexpr const char* kPriorFile = "prior.json";
// Names in a NetCDF file; the table of a star tracker is named by star_tracker_name() in both.
constexpr const char* kGyroGroup = "gyro";
constexpr const char* kTruthGroup = "truth";
constexpr const char* kSettingsAttribute = "pass_toml";
constexpr const char* kPriorAttribute = "prior_json";
constexpr const char* kTruthAttribute = "truth_json";

const std::vector<std::string> kQuaternionNames = {"q_x", "q_y", "q_z", "q_w"};

/// "star_tracker", "star_tracker_2" …
std::string star_tracker_name(std::size_t head) {
  return head == 0 ? "star_tracker" : fmt::format("star_tracker_{}", head + 1);
}

bool is_netcdf_name(const fs::path& path) { return path.extension() == ".nc"; }

fs::path inside(const fs::path& file, const char* part) { return file.string() + ":" + part; }

void check_there(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw InputRefused(path, {}, "there is no such file or directory", kGiveAPass);
  }
}

int gyros_of(const Series& gyro) { return static_cast<int>(gyro.columns.size() / 3); }

const std::string& required_attribute(const std::optional<std::string>& attribute, const fs::path& file,
                                      const char* name) {
  if (!attribute) {
    throw InputRefused(file, {}, fmt::format("lacks the attribute \"{}\"", name),
                       "write it as `trihedron simulate` does");
  }
  return *attribute;
}

/// One row per line, each column with its number of decimals.
void append_rows(fmt::memory_buffer& out, Time epoch, const std::vector<Time>& t, const std::vector<double>& values,
                 int decimals) {
  const std::size_t width = t.empty() ? 0 : values.size() / t.size();
  out.reserve(t.size() * (12 + width * static_cast<std::size_t>(decimals + 4)));
  for (std::size_t i = 0; i < t.size(); ++i) {
    check_stop();
    fmt::format_to(fmt::appender(out), "{}", format_seconds(t[i] - epoch));
    for (std::size_t j = 0; j < width; ++j) {
      fmt::format_to(fmt::appender(out), ",{:.{}f}", values[i * width + j], decimals);
    }
    out.push_back('\n');
  }
}

std::string csv_text(Time epoch, const std::vector<std::string>& columns, const std::vector<Time>& t,
                     const std::vector<double>& values, int decimals) {
  fmt::memory_buffer out;
  append_header(out, columns);
  append_rows(out, epoch, t, values, decimals);
  return fmt::to_string(out);
}

std::vector<double> quaternion_values(const std::vector<Eigen::Quaterniond>& quaternions) {
  std::vector<double> values;
  values.reserve(quaternions.size() * 4);
  for (const Eigen::Quaterniond& q : quaternions) {
    values.insert(values.end(), {q.x(), q.y(), q.z(), q.w()});
  }
  return values;
}

/// Six columns; NaN where it is not told.
std::vector<double> covariance_values(const std::vector<FixCovariance>& covariances) {
  std::vector<double> values;
  values.reserve(covariances.size() * covariance_names().size());
  for (const FixCovariance& its : covariances) {
    for (const double value : its.rad2) {
      values.push_back(its.is_told() ? value : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return values;
}

/// As a table of the pass has them.
std::string csv_text(Time epoch, const StarTrackerTelemetry& fixes, int decimals) {
  if (fixes.covariances.empty()) {
    return csv_text(epoch, kQuaternionNames, fixes.t, quaternion_values(fixes.q_in_c), decimals);
  }
  std::vector<std::string> columns = kQuaternionNames;
  std::ranges::copy(covariance_names(), std::back_inserter(columns));
  fmt::memory_buffer out;
  append_header(out, columns);
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    check_stop();
    const Eigen::Quaterniond& q = fixes.q_in_c[i];
    fmt::format_to(fmt::appender(out), "{},{:.{}f},{:.{}f},{:.{}f},{:.{}f}", format_seconds(fixes.t[i] - epoch), q.x(),
                   decimals, q.y(), decimals, q.z(), decimals, q.w(), decimals);
    for (const double value : fixes.covariances[i].rad2) {
      fmt::format_to(fmt::appender(out), ",{}", fixes.covariances[i].is_told() ? fmt::to_string(value) : "");
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

std::vector<std::string> truth_names(const Truth& truth) {
  std::vector<std::string> names = kQuaternionNames;
  for (std::string& name : direction_names(static_cast<int>(truth.gyros.size()))) {
    names.push_back(std::move(name));
  }
  return names;
}

std::vector<double> truth_values(const Truth& truth) {
  const std::size_t width = truth.gyros.size() * 3;
  std::vector<double> values;
  values.reserve(truth.t.size() * (4 + width));
  for (std::size_t i = 0; i < truth.t.size(); ++i) {
    const Eigen::Quaterniond& q = truth.q_in_c[i];
    values.insert(values.end(), {q.x(), q.y(), q.z(), q.w()});
    const auto h = truth.h_in.begin() + static_cast<std::ptrdiff_t>(i * width);
    values.insert(values.end(), h, h + static_cast<std::ptrdiff_t>(width));
  }
  return values;
}

void write_directory(StagedDirectory& staged, const Pass& pass, const Truth* truth) {
  // The sample passes' decimals: well below the noise of each quantity, the truth's below anything that is judged.
  constexpr int kGyroDecimals = 9;
  constexpr int kFixDecimals = 10;
  constexpr int kTruthDecimals = 12;
  const Time epoch = pass.settings.epoch;
  const auto add = [&](const std::string& name, const std::string& text) { write_file(staged.path() / name, text); };
  add(kSettingsFile, format_pass_toml(pass.settings, pass.settings.prior ? kPriorFile : ""));
  add(kGyroFile, csv_text(epoch, direction_names(pass.gyro.gyros), pass.gyro.t, pass.gyro.h, kGyroDecimals));
  for (std::size_t head = 0; head <= pass.further_star_trackers.size(); ++head) {
    const StarTrackerTelemetry& fixes = pass.fixes_of(head);
    add(star_tracker_name(head) + ".csv", csv_text(epoch, fixes, kFixDecimals));
  }
  // What the pass that was here before had more is not of this one.
  if (pass.settings.prior) {
    add(kPriorFile, format_calibration(*pass.settings.prior));
  } else {
    staged.drop(kPriorFile);
  }
  if (truth != nullptr) {
    add(kTruthFile, csv_text(epoch, truth_names(*truth), truth->t, truth_values(*truth), kTruthDecimals));
    add(kTruthParametersFile, format_truth_parameters(*truth));
  } else {
    staged.drop(kTruthFile);
    staged.drop(kTruthParametersFile);
  }
  staged.commit();
}

std::string long_name(const std::string& column, bool measured) {
  if (column.front() == 'c') {
    return fmt::format("covariance of the error of the fix about the axes {} of c, true = given exp(-error)",
                       column.substr(4, 2));
  }
  if (column.front() == 'q') {
    return fmt::format("attitude quaternion from star-tracker to inertial axes, {} component (Hamilton)",
                       column.back());
  }
  return fmt::format("direction cosine {} of the angular momentum of gyro {} in {} axes", column.back(),
                     column.substr(1, column.size() - 3), measured ? "its case" : "inertial");
}

/// Splits rows into columns.
std::vector<PackedColumn> columns_of(const std::vector<std::string>& names, const std::vector<double>& values,
                                     double step, bool measured) {
  const std::size_t width = names.size();
  std::vector<PackedColumn> columns(width);
  for (std::size_t j = 0; j < width; ++j) {
    columns[j] = {{names[j], names[j].front() == 'c' ? "rad2" : "1", long_name(names[j], measured), {}}, step};
    columns[j].values.reserve(values.size() / width);
    for (std::size_t k = j; k < values.size(); k += width) {
      columns[j].values.push_back(values[k]);
    }
  }
  return columns;
}

void write_netcdf(const fs::path& path, const Pass& pass, const Truth* truth, const PassFormat& format) {
  const Time epoch = pass.settings.epoch;
  NetcdfWriter file(path);
  file.write_attribute("", "Conventions", "CF-1.8");
  file.write_attribute("", "title", "Telemetry of electrostatic gyros and a star tracker");
  file.write_attribute("", "spacecraft", pass.settings.spacecraft);
  file.write_attribute("", "epoch_tai", format_epoch(epoch));
  file.write_attribute("", kSettingsAttribute, format_pass_toml(pass.settings, ""));
  if (pass.settings.prior) {
    file.write_attribute("", kPriorAttribute, format_calibration(*pass.settings.prior));
  }
  file.write_group(kGyroGroup, epoch, pass.gyro.t,
                   columns_of(direction_names(pass.gyro.gyros), pass.gyro.h, format.direction_step, true));
  for (std::size_t head = 0; head <= pass.further_star_trackers.size(); ++head) {
    const StarTrackerTelemetry& fixes = pass.fixes_of(head);
    std::vector<PackedColumn> columns = columns_of(kQuaternionNames, quaternion_values(fixes.q_in_c), 0, true);
    if (!fixes.covariances.empty()) {
      std::ranges::move(columns_of(covariance_names(), covariance_values(fixes.covariances), 0, true),
                        std::back_inserter(columns));
    }
    file.write_group(star_tracker_name(head), epoch, fixes.t, columns);
  }
  if (truth != nullptr) {
    file.write_group(kTruthGroup, epoch, truth->t, columns_of(truth_names(*truth), truth_values(*truth), 0, false));
    file.write_attribute(kTruthGroup, kTruthAttribute, format_truth_parameters(*truth));
  }
  file.commit();
}

std::optional<Truth> read_truth_netcdf(const fs::path& file) {
  const NetcdfInput reader(file);
  if (!reader.has_group(kTruthGroup)) {
    return std::nullopt;
  }
  const auto parameters = reader.text_attributes(kTruthGroup, {kTruthAttribute}).front();
  const auto settings = reader.text_attributes("", {kSettingsAttribute}).front();
  const Time epoch =
      parse_pass_epoch(required_attribute(settings, file, kSettingsAttribute), inside(file, kSettingsAttribute));
  return make_truth(required_attribute(parameters, file, kTruthAttribute), inside(file, kTruthAttribute),
                    reader.read_group(kTruthGroup, epoch, truth_columns), epoch);
}

std::optional<Truth> read_truth_directory(const fs::path& directory) {
  const fs::path table = directory / kTruthFile;
  const fs::path parameters_file = directory / kTruthParametersFile;
  const bool has_table = fs::exists(table);
  const bool has_parameters = fs::exists(parameters_file);
  if (!has_table && !has_parameters) {
    return std::nullopt;
  }
  if (!has_table || !has_parameters) {
    throw InputIncomplete(has_table ? parameters_file : table, {},
                          fmt::format("is missing beside {}", has_table ? kTruthFile : kTruthParametersFile),
                          "give both, or none");
  }
  const TextFile parameters(parameters_file);
  const Series series = read_csv(table, truth_columns);
  const fs::path settings_file = directory / kSettingsFile;
  const TextFile settings(settings_file);
  return make_truth(parameters.text(), parameters_file, series, parse_pass_epoch(settings.text(), settings_file));
}

TableInMemory in_memory(std::string name, Time epoch, const std::vector<Time>& t, std::vector<double> values) {
  TableInMemory table{std::move(name), {}, std::move(values)};
  table.t_s.reserve(t.size());
  std::ranges::transform(t, std::back_inserter(table.t_s), [&](Time at) { return to_seconds(at - epoch); });
  return table;
}

TableInMemory fixes_in_memory(std::string name, Time epoch, const StarTrackerTelemetry& fixes) {
  TableInMemory table = in_memory(std::move(name), epoch, fixes.t, quaternion_values(fixes.q_in_c));
  table.has_covariances = !fixes.covariances.empty();
  if (table.has_covariances) {
    const std::vector<double> quaternions = std::exchange(table.values, {});
    const std::vector<double> covariances = covariance_values(fixes.covariances);
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const auto q = quaternions.begin() + static_cast<std::ptrdiff_t>(4 * i);
      const auto covariance = covariances.begin() + static_cast<std::ptrdiff_t>(6 * i);
      table.values.insert(table.values.end(), q, q + 4);
      table.values.insert(table.values.end(), covariance, covariance + 6);
    }
  }
  return table;
}

Series series_of(TableInMemory table, std::vector<std::string> columns, const fs::path& file) {
  if (table.values.size() != table.t_s.size() * columns.size()) {
    throw InputRefused(file, {},
                       fmt::format("{} has {} times and {} values, of {} columns", table.name, table.t_s.size(),
                                   table.values.size(), columns.size()),
                       "give as many rows of values as there are times");
  }
  Series series;
  series.file = file;
  series.name = std::move(table.name);
  series.columns = std::move(columns);
  series.t_s = std::move(table.t_s);
  series.values = std::move(table.values);
  return series;
}

/// `path`: for messages.
LoadedPass screened(UnscreenedPass raw, const fs::path& path, const Selection& selection) {
  const ClockCorrection clocks{raw.settings.star_tracker_clock_offset_s, raw.settings.star_tracker_clock_rate_s_s, {}};
  for (Series& fixes : raw.star_trackers) {
    std::ranges::transform(fixes.t_s, fixes.t_s.begin(), [&](double t_s) { return clocks.true_s(t_s); });
  }
  LoadedPass loaded;
  loaded.defects = std::move(raw.left_out);
  raw.selection.from = selection.from ? selection.from : raw.selection.from;
  raw.selection.to = selection.to ? selection.to : raw.selection.to;
  raw.selection.exclude.insert(raw.selection.exclude.end(), selection.exclude.begin(), selection.exclude.end());
  const Time epoch = raw.settings.epoch;
  select(raw, path, loaded.defects);
  loaded.epoch_moved = raw.settings.epoch - epoch;
  loaded.pass.gyro = screen_gyro(std::move(raw.gyro), raw.settings, raw.settings_file, loaded.defects);
  for (std::size_t head = 0; head < raw.star_trackers.size(); ++head) {
    StarTrackerTelemetry& fixes =
        head == 0 ? loaded.pass.star_tracker : loaded.pass.further_star_trackers.emplace_back();
    fixes = screen_star_tracker(std::move(raw.star_trackers[head]), raw.settings, raw.settings_file, loaded.defects);
  }
  loaded.pass.settings = std::move(raw.settings);
  ClockCorrection gyros;
  for (std::size_t k = 0; k < loaded.pass.settings.gyros.size() && k < std::size_t{kMaxGyros}; ++k) {
    gyros.late_s[static_cast<int>(k)] = loaded.pass.settings.gyros[k].latency_s;
  }
  correct(loaded.pass, gyros);
  loaded.prior_file = std::move(raw.prior_file);
  loaded.sources = std::move(raw.sources);
  loaded.columns = std::move(raw.columns);
  if (loaded.columns.quaternion.empty()) {
    loaded.columns.quaternion = kQuaternionNames;
    const std::vector<std::string> names = direction_names(loaded.pass.gyro.gyros);
    for (auto name = names.begin(); name != names.end(); name += 3) {
      loaded.columns.directions.emplace_back(name, name + 3);
    }
  }
  return loaded;
}

}  // namespace

UnscreenedPass read_raw_directory(const fs::path& directory) {
  const fs::path settings_file = directory / kSettingsFile;
  const TextFile settings(settings_file);
  Series gyro = read_csv(directory / kGyroFile, gyro_columns);
  UnscreenedPass raw;
  raw.settings = parse_pass_toml(settings.text(), settings_file, directory, gyros_of(gyro));
  raw.settings_file = settings_file;
  raw.prior_file = parse_prior_file(settings.text(), settings_file, directory);
  raw.gyro = std::move(gyro);
  for (std::size_t head = 0; head <= raw.settings.further_star_trackers.size(); ++head) {
    raw.star_trackers.push_back(read_csv(directory / (star_tracker_name(head) + ".csv"), star_tracker_columns));
  }
  return raw;
}

UnscreenedPass read_raw_netcdf(const fs::path& file) {
  const NetcdfInput reader(file);
  const auto attributes = reader.text_attributes("", {kSettingsAttribute, kPriorAttribute});
  const std::string& settings_text = required_attribute(attributes[0], file, kSettingsAttribute);
  const Time epoch = parse_pass_epoch(settings_text, inside(file, kSettingsAttribute));
  UnscreenedPass raw;
  raw.gyro = reader.read_group(kGyroGroup, epoch, gyro_columns);
  raw.settings =
      parse_pass_toml(settings_text, inside(file, kSettingsAttribute), file.parent_path(), gyros_of(raw.gyro));
  raw.settings_file = inside(file, kSettingsAttribute);
  raw.prior_file = parse_prior_file(settings_text, inside(file, kSettingsAttribute), file.parent_path());
  for (std::size_t head = 0; head <= raw.settings.further_star_trackers.size(); ++head) {
    raw.star_trackers.push_back(reader.read_group(star_tracker_name(head), epoch, star_tracker_columns));
  }
  if (const auto& prior = attributes[1]) {
    raw.settings.prior = parse_calibration(*prior, inside(file, kPriorAttribute));
    check_prior(*raw.settings.prior, inside(file, kPriorAttribute), gyros_of(raw.gyro));
  }
  return raw;
}

LoadedPass read_pass(const fs::path& path, const Selection& selection) {
  check_there(path);
  const auto format = std::ranges::find_if(kInputFormats, [&](const InputFormat& f) { return f.recognises(path); });
  return screened(format->read(path), path, selection);
}

std::vector<std::filesystem::path> inputs_of(const std::filesystem::path& path, const LoadedPass& loaded) {
  std::vector<std::filesystem::path> inputs = {path, loaded.prior_file};
  inputs.insert(inputs.end(), loaded.sources.begin(), loaded.sources.end());
  return inputs;
}

LoadedPass read_telemetry(const fs::path& file, const ReadColumns& others) {
  check_there(file);
  return screened(read_raw_telemetry(file, others), file, {});
}

PassInMemory read_tables(const fs::path& directory) {
  check_there(directory);
  UnscreenedPass raw = read_raw_directory(directory);
  const auto table = [](Series&& series) {
    return TableInMemory{std::move(series.name), std::move(series.t_s), std::move(series.values)};
  };
  const auto table_of_fixes = [&](Series&& series) {
    // Variances alone get the covariances that they stand for.
    const std::size_t width = series.columns.size();
    std::vector<double> values = series.values;
    if (width == kQuaternionNames.size() + kVariances) {
      values.clear();
      for (std::size_t row = 0; row < series.rows(); ++row) {
        values.insert(values.end(), series.row(row), series.row(row) + width);
        values.insert(values.end(), kVariances, 0.0);
      }
    }
    return TableInMemory{std::move(series.name), std::move(series.t_s), std::move(values),
                         width > kQuaternionNames.size()};
  };
  PassInMemory tables;
  tables.name = directory;
  tables.settings = format_pass_toml(raw.settings, "", TelemetryStamps::kAsReceived);
  tables.prior = raw.settings.prior ? format_calibration(*raw.settings.prior) : "";
  tables.gyros = gyros_of(raw.gyro);
  tables.gyro = table(std::move(raw.gyro));
  for (Series& fixes : raw.star_trackers) {
    tables.star_trackers.push_back(table_of_fixes(std::move(fixes)));
  }
  return tables;
}

PassSettings parse_settings(const std::string& settings, const std::string& prior, const fs::path& name, int gyros) {
  PassSettings its = parse_pass_toml(settings, inside(name, kSettingsAttribute), name.parent_path(), gyros);
  if (!prior.empty()) {
    its.prior = parse_calibration(prior, inside(name, kPriorAttribute));
    check_prior(*its.prior, inside(name, kPriorAttribute), gyros);
  }
  return its;
}

LoadedPass screened(PassInMemory tables, const Selection& selection) {
  UnscreenedPass raw;
  raw.settings = parse_settings(tables.settings, tables.prior, tables.name, tables.gyros);
  raw.settings_file = inside(tables.name, kSettingsAttribute);
  const std::size_t heads = 1 + raw.settings.further_star_trackers.size();
  if (tables.star_trackers.size() != heads) {
    throw InputRefused(
        tables.name, {},
        fmt::format("has {} tables of star trackers, and settings of {}", tables.star_trackers.size(), heads),
        "give a [[star_tracker.further]] for each but the first");
  }
  raw.gyro = series_of(std::move(tables.gyro), direction_names(tables.gyros), tables.name);
  for (TableInMemory& fixes : tables.star_trackers) {
    std::vector<std::string> columns = kQuaternionNames;
    if (fixes.has_covariances) {
      std::ranges::copy(covariance_names(), std::back_inserter(columns));
    }
    raw.star_trackers.push_back(series_of(std::move(fixes), std::move(columns), tables.name));
  }
  return screened(std::move(raw), tables.name, selection);
}

PassInMemory tables_of(const Pass& pass, double direction_step) {
  const Time epoch = pass.settings.epoch;
  PassInMemory tables;
  tables.settings = format_pass_toml(pass.settings, "");
  tables.prior = pass.settings.prior ? format_calibration(*pass.settings.prior) : "";
  tables.gyros = pass.gyro.gyros;
  tables.gyro = in_memory(kGyroGroup, epoch, pass.gyro.t, pass.gyro.h);
  for (double& value : tables.gyro.values) {
    value = std::isfinite(value) ? static_cast<double>(std::lround(value / direction_step)) * direction_step : value;
  }
  for (std::size_t head = 0; head <= pass.further_star_trackers.size(); ++head) {
    const StarTrackerTelemetry& fixes = pass.fixes_of(head);
    tables.star_trackers.push_back(fixes_in_memory(star_tracker_name(head), epoch, fixes));
  }
  return tables;
}

TruthInMemory tables_of(const Truth& truth, Time epoch) {
  TruthInMemory tables;
  tables.parameters = format_truth_parameters(truth);
  tables.gyros = static_cast<int>(truth.gyros.size());
  tables.table = in_memory(kTruthGroup, epoch, truth.t, truth_values(truth));
  return tables;
}

Truth truth_of(TruthInMemory tables, const fs::path& name, Time epoch) {
  std::vector<std::string> columns = kQuaternionNames;
  std::ranges::move(direction_names(tables.gyros), std::back_inserter(columns));
  return make_truth(tables.parameters, inside(name, kTruthAttribute),
                    series_of(std::move(tables.table), std::move(columns), name), epoch);
}

std::optional<Truth> read_truth(const fs::path& path) {
  check_there(path);
  if (is_telemetry_map(path) && !fs::is_directory(path)) {
    return std::nullopt;
  }
  return fs::is_directory(path) ? read_truth_directory(path) : read_truth_netcdf(path);
}

PassFormat format_for(const Scenario& scenario) {
  PassFormat format;
  double step = scenario.gyros.front().readout.quantum_rad;
  for (const GyroScenario& gyro : scenario.gyros) {
    step = std::min(step, gyro.readout.quantum_rad);
  }
  format.direction_step = std::max(step, format.direction_step);
  return format;
}

PassWriter::PassWriter(fs::path path) : path_(std::move(path)) {
  if (is_netcdf_name(path_)) {
    expect_writable(path_);
  } else {
    staged_.emplace(path_);
  }
}

void PassWriter::write(const Pass& pass, const Truth* truth, const PassFormat& format) {
  if (staged_) {
    write_directory(*staged_, pass, truth);
  } else {
    write_netcdf(path_, pass, truth, format);
  }
}

void write_pass(const fs::path& path, const Pass& pass, const Truth* truth, const PassFormat& format) {
  PassWriter(path).write(pass, truth, format);
}

std::vector<fs::path> files_of_pass(const fs::path& path, std::size_t star_trackers) {
  if (is_netcdf_name(path)) {
    return {path};
  }
  std::vector<fs::path> files;
  for (const char* name : {kSettingsFile, kGyroFile, kTruthFile, kTruthParametersFile, kPriorFile}) {
    files.push_back(path / name);
  }
  for (std::size_t head = 0; head < star_trackers; ++head) {
    files.push_back(path / (star_tracker_name(head) + ".csv"));
  }
  return files;
}

}  // namespace trihedron::io
