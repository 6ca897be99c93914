#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "input_formats.hpp"
#include "packets.hpp"
#include "selection.hpp"
#include "telemetry_map.hpp"
#include "telemetry_table.hpp"
#include "text_file.hpp"
#include "toml_table.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/limits.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// A column of the result: from which column of the table, and by what to multiply.
struct Part {
  std::size_t place = 0;
  double factor = 1;
};

/// The names of the columns of one table, each once.
class Wanted {
 public:
  std::size_t place(const std::string& column) {
    const auto found = std::ranges::find(names_, column);
    if (found != names_.end()) {
      return static_cast<std::size_t>(found - names_.begin());
    }
    names_.push_back(column);
    return names_.size() - 1;
  }
  /// "-NAME" changes the sign.
  std::vector<Part> parts(const std::vector<std::string>& names, double factor) {
    std::vector<Part> parts;
    for (const std::string& name : names) {
      const bool is_minus = name.starts_with('-');
      parts.push_back({place(is_minus ? name.substr(1) : name), is_minus ? -factor : factor});
    }
    return parts;
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

/// What tells whether a row is good.
struct Flag {
  std::optional<std::size_t> place;
  std::vector<double> good;
  std::string column{};

  [[nodiscard]] bool is_good(const ForeignTable& table, std::size_t row) const {
    return !place || std::ranges::find(good, table.numbers[*place][row]) != good.end();
  }
};

Flag flag_of(const FlagMap& map, Wanted& wanted) {
  return {map.column.empty() ? std::nullopt : std::optional(wanted.place(map.column)), map.good, map.column};
}

/// Throws InputRefused where not one row is good, as where `good` has the values that are bad. `whose`: for people.
void expect_any_good(const Flag& flag, const ForeignTable& table, std::string_view whose, const fs::path& file) {
  constexpr std::size_t kShown = 5;
  std::vector<double> values;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (flag.is_good(table, row)) {
      return;
    }
    const double value = table.numbers[*flag.place][row];
    if (std::isfinite(value) && values.size() < kShown && std::ranges::find(values, value) == values.end()) {
      values.push_back(value);
    }
  }
  if (table.rows() == 0) {
    return;  // is refused for that
  }
  throw InputRefused(file, {},
                     fmt::format("flag \"{}\" of {} is in no row of {} a value of good = [{}]", flag.column, whose,
                                 table.name, fmt::join(flag.good, ", ")),
                     values.empty()
                         ? "name the column of the flag: this one has no numbers"
                         : fmt::format("give the values that are good: there are {}", fmt::join(values, ", ")));
}

ForeignTable read_table(const TableMap& map, const fs::path& directory, const Wanted& wanted,
                        const ReadColumns& others) {
  ForeignTable table = read_foreign_table(map, directory, {map.time_column}, wanted.names(), others);
  if (table.rows() > 0 && std::ranges::all_of(table.stamps.front(), [](Time t) { return t == kNoTime; })) {
    throw InputRefused(table.file, {table.first_line, 0},
                       fmt::format("not one value of column \"{}\" is a time", map.time_column),
                       "check scale, format and since of its time");
  }
  return table;
}

/// Its stamps in seconds since the epoch; no values yet.
Series series_of(const ForeignTable& table, Time epoch, std::vector<std::string> columns) {
  Series series;
  series.file = table.file;
  series.name = table.name;
  series.first_line = table.first_line;
  series.row_in_file = table.row_in_file;
  series.cut_line = table.cut_line;
  series.columns = std::move(columns);
  for (const Time t : table.stamps.front()) {
    series.t_s.push_back(t == kNoTime ? std::numeric_limits<double>::quiet_NaN() : to_seconds(t - epoch));
  }
  series.values.reserve(series.rows() * series.columns.size());
  return series;
}

// ---- Gyros

struct GyroParts {
  std::vector<Part> direction;
  double angle_unit_rad = 0;
  Flag flag;

  [[nodiscard]] double value(const Part& part, const ForeignTable& table, std::size_t row) const {
    const double given = table.numbers[part.place][row];
    if (angle_unit_rad == 0) {
      return part.factor * given;
    }
    // An angle from an axis: the sign turns the axis round.
    const double cosine = std::cos(std::abs(part.factor) * angle_unit_rad * given);
    return part.factor < 0 ? -cosine : cosine;
  }
};

struct GyroSource {
  std::vector<GyroParts> gyros;
  ForeignTable table;
};

/// Gives the table of a map with the columns that are wanted of it.
using ReadTable = std::function<ForeignTable(const TableMap&, const Wanted&)>;

GyroSource read_gyros(const GyroMap& map, const ReadTable& read) {
  GyroSource source;
  Wanted wanted;
  for (const DirectionMap& unit : map.units) {
    source.gyros.push_back(
        {wanted.parts(unit.columns, 1 / unit.counts_per_unit), unit.angle_unit_rad, flag_of(unit.flag, wanted)});
  }
  source.table = read(map, wanted);
  return source;
}

Series gyro_series(const GyroSource& source, Time epoch, std::vector<Defect>& defects) {
  const ForeignTable& table = source.table;
  Series series = series_of(table, epoch, direction_names(static_cast<int>(source.gyros.size())));
  std::vector<Defect> flagged(source.gyros.size());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    for (std::size_t k = 0; k < source.gyros.size(); ++k) {
      const GyroParts& gyro = source.gyros[k];
      const bool is_good = gyro.flag.is_good(table, row);
      if (!is_good) {
        add_place(flagged[k], series, row);
      }
      for (const Part& part : gyro.direction) {
        series.values.push_back(is_good ? gyro.value(part, table, row) : std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  for (std::size_t k = 0; k < flagged.size(); ++k) {
    if (flagged[k].count > 0) {
      flagged[k].kind = Defect::Kind::kFlagged;
      flagged[k].where = fmt::format("{}, gyro {}", series.name, k + 1);
      defects.push_back(std::move(flagged[k]));
    }
  }
  return series;
}

// ---- Star trackers

struct StarTrackerSource {
  std::vector<Part> quaternion;  ///< x, y, z, w of q_in_c
  std::vector<Part> sigma;       ///< empty where there is none; of a covariance the diagonal
  bool is_variance = false;
  std::vector<Part> covariance;                         ///< xy, xz, yz; empty where there is none
  Eigen::Matrix3d C_c_s = Eigen::Matrix3d::Identity();  ///< from the axes of the head, as designed
  double largest_sigma_rad = std::numeric_limits<double>::infinity();
  Flag flag;
  ForeignTable table;

  /// 1-sigma of a fix.
  [[nodiscard]] Eigen::Vector3d sigma_rad(std::size_t row) const {
    Eigen::Vector3d result;
    for (int i = 0; i < 3; ++i) {
      const Part& part = sigma[static_cast<std::size_t>(i)];
      const double value = table.numbers[part.place][row];
      result(i) = part.factor * (is_variance ? std::sqrt(value) : value);
    }
    return result;
  }
  /// Of its error, c axes.
  [[nodiscard]] Eigen::Matrix3d covariance_rad2(std::size_t row) const {
    Eigen::Matrix3d its = sigma_rad(row).cwiseAbs2().asDiagonal();
    constexpr std::array<std::array<int, 2>, 3> kPlaces = {{{0, 1}, {0, 2}, {1, 2}}};
    for (std::size_t i = 0; i < covariance.size(); ++i) {
      const auto [a, b] = kPlaces[i];
      its(a, b) = covariance[i].factor * table.numbers[covariance[i].place][row];
      its(b, a) = its(a, b);
    }
    return C_c_s * its * C_c_s.transpose();
  }
  [[nodiscard]] bool is_sure(std::size_t row) const {
    if (sigma.empty()) {
      return true;
    }
    const Eigen::Vector3d its = sigma_rad(row);
    return (its.array() > 0).all() && (its.array() <= largest_sigma_rad).all();
  }
};

StarTrackerSource read_star_tracker(const StarTrackerMap& map, const Eigen::Matrix3d& C_c_s, const ReadTable& read) {
  StarTrackerSource source;
  source.C_c_s = C_c_s;
  Wanted wanted;
  source.quaternion = wanted.parts(map.quaternion, 1 / map.counts_per_unit);
  if (map.scalar_first) {
    std::ranges::rotate(source.quaternion, source.quaternion.begin() + 1);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    source.quaternion[i].factor *= map.is_inverse ? -1 : 1;
  }
  source.sigma = wanted.parts(map.sigma, map.sigma_unit_rad);
  source.is_variance = map.is_variance;
  if (!map.covariance.empty()) {
    const auto off_diagonal = map.covariance.begin() + kVariances;
    source.sigma = wanted.parts({map.covariance.begin(), off_diagonal}, map.sigma_unit_rad);
    source.is_variance = true;
    source.covariance = wanted.parts({off_diagonal, map.covariance.end()}, map.sigma_unit_rad * map.sigma_unit_rad);
  }
  source.largest_sigma_rad = map.largest_sigma_rad.value_or(source.largest_sigma_rad);
  source.flag = flag_of(map.flag, wanted);
  source.table = read(map, wanted);
  return source;
}

Series star_tracker_series(const StarTrackerSource& source, Time epoch, std::vector<Defect>& defects) {
  const ForeignTable& table = source.table;
  std::vector<std::string> columns = {"q_x", "q_y", "q_z", "q_w"};
  if (!source.sigma.empty()) {
    std::ranges::copy(covariance_names(), std::back_inserter(columns));
  }
  Series series = series_of(table, epoch, std::move(columns));
  std::vector<bool> is_good;
  std::vector<bool> is_sure;  // of those that are good
  for (std::size_t row = 0; row < table.rows(); ++row) {
    is_good.push_back(source.flag.is_good(table, row));
    if (is_good.back()) {
      is_sure.push_back(source.is_sure(row));
    }
    for (const Part& part : source.quaternion) {
      series.values.push_back(table.numbers[part.place][row] * part.factor);
    }
    if (!source.sigma.empty()) {
      const Eigen::Matrix3d its = source.covariance_rad2(row);
      series.values.insert(series.values.end(), {its(0, 0), its(1, 1), its(2, 2), its(0, 1), its(0, 2), its(1, 2)});
    }
  }
  leave_out(
      series, [&](std::size_t row) { return !is_good[row]; }, Defect::Kind::kFlagged, defects);
  leave_out(
      series, [&](std::size_t row) { return !is_sure[row]; }, Defect::Kind::kLargeSigma, defects);
  return series;
}

/// The median of the fixes that are used, about each axis.
Eigen::Vector3d usual_sigma(const StarTrackerSource& source, const fs::path& path) {
  std::array<std::vector<double>, 3> sigmas;
  for (std::size_t row = 0; row < source.table.rows(); ++row) {
    if (source.flag.is_good(source.table, row) && source.is_sure(row)) {
      const Eigen::Vector3d its = source.sigma_rad(row);
      for (std::size_t i = 0; i < 3; ++i) {
        sigmas[i].push_back(its(static_cast<int>(i)));
      }
    }
  }
  if (sigmas.front().empty()) {
    throw InputRefused(path, {}, "not one fix has a flag that is good and a sigma that is small enough",
                       "check flag, good, sigma_unit and largest_sigma_rad");
  }
  Eigen::Vector3d usual;
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<double>& values = sigmas[i];
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    if (!limits::kStarTrackerNoise_rad.holds(*middle)) {
      throw InputRefused(path, {},
                         fmt::format("the usual sigma of a fix is {:g} rad, no noise of a star tracker", *middle),
                         "correct sigma_unit or sigma_is, or give noise_rad in [star_tracker]");
    }
    usual(static_cast<int>(i)) = *middle;
  }
  return usual;
}

// ---- What is not told

struct Span {
  Time first{};
  Time last{};
};

/// Where the telemetry lies. A day without a row parts corrupt stamps from it.
Span span_of(const ForeignTable& table, const fs::path& path) {
  constexpr Duration kApart = std::chrono::hours(24);
  constexpr double kMost = 0.99;
  std::vector<Time> t;
  std::ranges::copy_if(table.stamps.front(), std::back_inserter(t), [](Time time) { return time != kNoTime; });
  std::ranges::sort(t);
  std::size_t first = 0;
  for (std::size_t i = 1; i <= t.size(); ++i) {
    if (i < t.size() && t[i] - t[i - 1] < kApart) {
      continue;
    }
    if (static_cast<double>(i - first) >= kMost * static_cast<double>(t.size())) {
      return {t[first], t[i - 1]};
    }
    first = i;
  }
  throw InputRefused(path, {},
                     t.empty() ? fmt::format("{} has no row with a time", table.name)
                               : fmt::format("the rows of {} lie days apart, from {} to {} TAI", table.name,
                                             format_epoch(t.front()), format_epoch(t.back())),
                     "give epoch_tai and duration_s in [pass]");
}

void expect_within(const Range& range, Duration value, const fs::path& path, std::string_view key) {
  if (!range.holds(to_seconds(value))) {
    throw InputRefused(path, {},
                       fmt::format("{} is {:g} s by the stamps, outside {:g} to {:g} s: {}", key, to_seconds(value),
                                   range.least, range.most, range.why),
                       range.holds(1e-3 * to_seconds(value))   ? "they look like milliseconds: format = \"ms\""
                       : range.holds(1e-6 * to_seconds(value)) ? "they look like microseconds: format = \"us\""
                                                               : "check the format of the time, or tell the key");
  }
}

/// The median step from row to row, to the microsecond.
Duration usual_step(const ForeignTable& table, const fs::path& path, std::string_view section, const Range& range) {
  std::vector<Duration> steps;
  const std::vector<Time>& t = table.stamps.front();
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i - 1] != kNoTime && t[i] > t[i - 1]) {
      steps.push_back(t[i] - t[i - 1]);
    }
  }
  if (steps.empty()) {
    throw InputRefused(path, {}, fmt::format("{} has no two rows that show its period", table.name),
                       fmt::format("give period_s in [{}]", section));
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  const Duration period = std::chrono::round<std::chrono::microseconds>(*middle);
  expect_within(range, period, path, fmt::format("period_s of [{}]", section));
  return period;
}

void measure(PassSettings& settings, const GyroSource& gyros, const StarTrackerSource& fixes, const fs::path& path) {
  using std::chrono::seconds;
  if (settings.gyro_period == Duration::zero()) {
    settings.gyro_period = usual_step(gyros.table, path, "gyro", limits::kGyroPeriod_s);
  }
  if (settings.star_tracker_period == Duration::zero()) {
    settings.star_tracker_period = usual_step(fixes.table, path, "star_tracker", limits::kStarTrackerPeriod_s);
  }
  const bool has_epoch = settings.epoch != Time{};
  const bool has_duration = settings.duration != Duration::zero();
  if (!has_epoch || !has_duration) {
    const Span span = span_of(gyros.table, path);
    if (!has_epoch) {
      settings.epoch = Time(std::chrono::floor<seconds>(span.first.time_since_epoch()));
    }
    if (!has_duration) {
      settings.duration = std::chrono::ceil<seconds>(span.last - settings.epoch);
      expect_within(limits::kPassDuration_s, settings.duration, path, "duration_s of [pass]");
    }
  }
  if (settings.star_tracker_noise_rad.isZero(0)) {
    settings.star_tracker_noise_rad = usual_sigma(fixes, path);
  }
}

std::string negated(const std::string& name) { return name.starts_with('-') ? name.substr(1) : "-" + name; }

ColumnsRead columns_read(const TelemetryMap& map) {
  ColumnsRead columns;
  const StarTrackerMap& head = map.star_trackers.front();
  columns.quaternion = head.quaternion;
  if (head.scalar_first) {
    std::ranges::rotate(columns.quaternion, columns.quaternion.begin() + 1);
  }
  for (std::size_t i = 0; i < 3 && head.is_inverse; ++i) {
    columns.quaternion[i] = negated(columns.quaternion[i]);
  }
  for (const DirectionMap& unit : map.gyro.units) {
    columns.directions.push_back(unit.columns);
  }
  return columns;
}

}  // namespace

bool is_telemetry_toml(const fs::path& file) {
  if (!is_telemetry_map(file)) {
    return false;
  }
  try {
    return parse_toml(TextFile(file).text(), file).contains("telemetry");
  } catch (const InputRefused&) {
    return false;
  }
}

bool is_telemetry_map(const fs::path& path) { return path.extension() == ".toml"; }

UnscreenedPass read_raw_telemetry(const fs::path& file) { return read_raw_telemetry(file, {}); }

UnscreenedPass read_raw_telemetry(const fs::path& file, const ReadColumns& others) {
  const TextFile text(file);
  const fs::path directory = file.parent_path();
  TelemetryToml told = parse_telemetry_toml(text.text(), file, directory);
  const TelemetryMap& map = told.map;
  UnscreenedPass raw;
  raw.settings = std::move(told.settings);
  raw.settings_file = file;
  raw.prior_file = std::move(told.prior_file);
  raw.selection.from = map.from;
  raw.selection.to = map.to;
  for (const IntervalMap& intervals : map.exclude) {
    raw.sources.push_back(directory / intervals.file);
    std::ranges::copy(read_intervals(intervals, directory, others), std::back_inserter(raw.selection.exclude));
  }
  PacketTables packets;
  if (map.packets) {
    const fs::path packet_file = directory / map.packets->file;
    raw.sources.push_back(packet_file);
    const TextFile octets(packet_file);
    packets = parse_packets(octets.text(), packet_file, *map.packets, map.star_trackers.size());
    raw.left_out = std::move(packets.defects);
  }
  std::size_t given = 0;
  const ReadTable read = [&](const TableMap& table, const Wanted& wanted) {
    if (map.packets) {
      return std::move(packets.tables.at(given++));
    }
    raw.sources.push_back(directory / table.file);
    return read_table(table, directory, wanted, others);
  };
  const GyroSource gyros = read_gyros(map.gyro, read);
  std::vector<StarTrackerSource> heads;
  for (const StarTrackerMap& head : map.star_trackers) {
    Eigen::Matrix3d C_c_s = Eigen::Matrix3d::Identity();
    if (!heads.empty()) {
      const FurtherStarTracker& its = raw.settings.further_star_trackers.at(heads.size() - 1);
      C_c_s = Rot<C, C>::exp(Vec<C>::assume(its.mounting_rotation_vector_rad)).raw();
    }
    heads.push_back(read_star_tracker(head, C_c_s, read));
  }
  for (std::size_t k = 0; k < gyros.gyros.size(); ++k) {
    expect_any_good(gyros.gyros[k].flag, gyros.table, fmt::format("gyro {}", k + 1), file);
  }
  expect_any_good(heads.front().flag, heads.front().table, "the star tracker", file);
  raw.columns = columns_read(map);
  measure(raw.settings, gyros, heads.front(), file);
  raw.gyro = gyro_series(gyros, raw.settings.epoch, raw.left_out);
  for (const StarTrackerSource& head : heads) {
    raw.star_trackers.push_back(star_tracker_series(head, raw.settings.epoch, raw.left_out));
  }
  return raw;
}

}  // namespace trihedron::io
