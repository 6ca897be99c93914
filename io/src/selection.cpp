#include "selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "screening.hpp"
#include "telemetry_table.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

/// Stamps are known to a microsecond at best.
constexpr double kResolution_s = 1e-6;

}  // namespace

void add_place(Defect& defect, const Series& series, std::size_t row) {
  ++defect.count;
  if (defect.first.size() < Defect::kPlaces) {
    defect.first.push_back({series.position(row).line, static_cast<std::int64_t>(series.place(row)), series.t_s[row]});
  }
}

void leave_out(Series& series, const std::function<bool(std::size_t)>& is_left_out, Defect::Kind kind,
               std::vector<Defect>& defects) {
  Defect defect;
  defect.kind = kind;
  defect.where = series.name;
  const std::size_t width = series.columns.size();
  std::vector<std::size_t> row_in_file;
  for (std::size_t row = 0; row < series.rows(); ++row) {
    if (is_left_out(row)) {
      add_place(defect, series, row);
      continue;
    }
    const std::size_t kept = row_in_file.size();
    row_in_file.push_back(series.place(row));
    series.t_s[kept] = series.t_s[row];
    std::copy_n(series.row(row), width, series.values.begin() + static_cast<std::ptrdiff_t>(kept * width));
  }
  if (defect.count == 0) {
    return;
  }
  series.t_s.resize(row_in_file.size());
  series.values.resize(row_in_file.size() * width);
  series.row_in_file = std::move(row_in_file);
  defects.push_back(std::move(defect));
}

void select(UnscreenedPass& raw, const fs::path& path, std::vector<Defect>& defects) {
  const Selection& selection = raw.selection;
  PassSettings& settings = raw.settings;
  if (!selection.from && !selection.to && selection.exclude.empty()) {
    return;
  }
  const Time epoch = settings.epoch;
  const Time end_of_pass = epoch + settings.duration;
  const Time begin = std::max(epoch, selection.from.value_or(epoch));
  const Time end = std::min(end_of_pass, selection.to.value_or(end_of_pass));
  if (selection.from && selection.to && *selection.to < *selection.from) {
    throw InputRefused(
        path, {},
        fmt::format("the time range asked for ends, at {} TAI, before it begins, at {} TAI",
                    format_epoch(*selection.to), format_epoch(*selection.from)),
        "exchange its ends; one that the command does not give is that of the description of the telemetry");
  }
  if (end - begin < kShortestPass) {
    throw InputRefused(
        path, {},
        fmt::format("less than a minute of the pass, which lasts from {} to {} TAI, lies in the time range asked for",
                    format_epoch(epoch), format_epoch(end_of_pass)),
        "widen the time range");
  }
  const double begin_s = to_seconds(begin - epoch);
  const double end_s = to_seconds(end - epoch);
  const auto apply = [&](Series& series, bool LeftOut::*of) {
    const auto is_excluded = [&](std::size_t row) {
      return std::ranges::any_of(selection.exclude, [&](const LeftOut& interval) {
        const double t_s = series.t_s[row] + kResolution_s;
        return interval.*of && t_s >= to_seconds(interval.begin - epoch) && t_s < to_seconds(interval.end - epoch);
      });
    };
    const auto is_outside = [&](std::size_t row) {
      const double t_s = series.t_s[row];
      return (selection.from && t_s < begin_s - kResolution_s) || (selection.to && t_s > end_s + kResolution_s);
    };
    leave_out(series, is_outside, Defect::Kind::kOutsideRange, defects);
    leave_out(series, is_excluded, Defect::Kind::kExcluded, defects);
    std::ranges::transform(series.t_s, series.t_s.begin(), [&](double t_s) { return t_s - begin_s; });
  };
  apply(raw.gyro, &LeftOut::gyros);
  for (Series& fixes : raw.star_trackers) {
    apply(fixes, &LeftOut::star_trackers);
  }
  // What was found before counts from the epoch of the whole, what screening finds from that of the part.
  for (Defect& defect : defects) {
    for (Place& place : defect.first) {
      place.t_s -= begin_s;
    }
  }
  settings.epoch = begin;
  settings.duration = end - begin;
}

std::vector<LeftOut> read_intervals(const IntervalMap& map, const fs::path& directory, const ReadColumns& others) {
  const ForeignTable table = read_foreign_table(map, directory, {map.time_column, map.end_column}, {}, others);
  if (table.cut_line > 0) {
    throw InputRefused(table.file, {table.cut_line, 0}, "the last line is cut short", "write the file again");
  }
  std::vector<LeftOut> intervals;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Time begin = table.stamps[0][row];
    const Time end = table.stamps[1][row];
    if (begin == kNoTime || end == kNoTime || end <= begin) {
      const std::int64_t line =
          table.first_line > 0 ? table.first_line + static_cast<std::int64_t>(table.row_in_file[row]) : 0;
      throw InputRefused(table.file, {line, 0}, fmt::format("interval {} does not end after it begins", row + 1),
                         "give the beginning, then the end");
    }
    intervals.push_back({begin, end, map.gyros, map.star_trackers});
  }
  return intervals;
}

std::vector<LeftOut> read_intervals(const fs::path& file, TimeScale scale) {
  IntervalMap map;
  map.stamps.scale = scale;
  map.file = file.string();
  map.time_column = "begin";
  map.end_column = "end";
  return read_intervals(map, "");
}

}  // namespace trihedron::io
