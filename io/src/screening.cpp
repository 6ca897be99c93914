#include "screening.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "leaping_stamps.hpp"
#include "trihedron/records/limits.hpp"
#include "unusable.hpp"

namespace trihedron::io {
namespace {

constexpr double kNormTolerance = 1e-3;
constexpr std::size_t kStuckSamples = 8;
constexpr Duration kSilence = std::chrono::minutes(1);
constexpr double kGapPeriods = 1.5;

/// Collects one kind of defect of one table.
class Tally {
 public:
  Tally(const Series& series, Defect::Kind kind, std::string where) : series_(series) {
    defect_.kind = kind;
    defect_.where = std::move(where);
  }

  void add(std::size_t row, std::int64_t count = 1) {
    defect_.count += count;
    if (defect_.first.size() < Defect::kPlaces) {
      const double t_s = row < series_.rows() ? series_.t_s[row] : std::numeric_limits<double>::quiet_NaN();
      defect_.first.push_back({series_.position(row).line, static_cast<std::int64_t>(series_.place(row)), t_s});
    }
  }
  void add_stretch(std::size_t row, std::int64_t count, Duration length) {
    add(row, count);
    defect_.total += length;
    defect_.longest = std::max(defect_.longest, length);
  }
  void report(std::vector<Defect>& defects) {
    if (defect_.count > 0) {
      defects.push_back(std::move(defect_));
    }
  }

 private:
  const Series& series_;
  Defect defect_;
};

/// The rows that stay, and their times.
struct Kept {
  std::vector<std::size_t> rows;
  std::vector<Time> t;
};

/// `of_another_time`: finds among rows whose times increase those that bear the time of others.
template <class OfAnotherTime>
Kept keep_increasing(const Series& series, const PassSettings& settings, Duration period, std::vector<Defect>& defects,
                     const OfAnotherTime& of_another_time) {
  using enum Defect::Kind;
  Tally missing(series, kMissingTime, series.name);
  Tally outside(series, kTimeOutsidePass, series.name);
  Tally repeated(series, kRepeatedTime, series.name);
  Tally backward(series, kBackwardTime, series.name);
  Tally leaping(series, kLeapingTime, series.name);

  const double earliest_s = -to_seconds(period);
  const double latest_s = to_seconds(settings.duration + period);
  std::vector<Time> t(series.rows());
  std::vector<std::size_t> candidates;
  candidates.reserve(series.rows());
  for (std::size_t row = 0; row < series.rows(); ++row) {
    const double t_s = series.t_s[row];
    if (!std::isfinite(t_s)) {
      missing.add(row);
    } else if (t_s < earliest_s || t_s > latest_s) {
      outside.add(row);
    } else {
      t[row] = settings.epoch + from_seconds(t_s);
      candidates.push_back(row);
    }
  }

  Kept kept;
  kept.rows = longest_increasing(t, candidates);
  const std::vector<std::size_t> of_others = of_another_time(kept.rows, t);
  if (!of_others.empty()) {
    for (const std::size_t row : of_others) {
      leaping.add(row);
    }
    std::erase_if(candidates, [&](std::size_t row) { return std::ranges::binary_search(of_others, row); });
    kept.rows = longest_increasing(t, candidates);
  }
  kept.t.reserve(kept.rows.size());
  for (const std::size_t row : kept.rows) {
    kept.t.push_back(t[row]);
  }
  if (kept.rows.size() < candidates.size()) {
    std::vector<std::size_t> left_out;
    std::ranges::set_difference(candidates, kept.rows, std::back_inserter(left_out));
    for (const std::size_t row : left_out) {
      (std::ranges::binary_search(kept.t, t[row]) ? repeated : backward).add(row);
    }
  }

  Tally truncated(series, kTruncatedLine, series.name);
  if (series.cut_line > 0) {
    truncated.add(series.rows());
  }
  Tally gaps(series, kGap, series.name);
  const Duration longest_step(std::llround(static_cast<double>(period.count()) * kGapPeriods));
  if (!kept.t.empty()) {
    Time last = settings.epoch;
    for (std::size_t i = 0; i <= kept.t.size(); ++i) {
      const Time next = i < kept.t.size() ? kept.t[i] : settings.epoch + settings.duration;
      if (next - last > longest_step) {
        gaps.add_stretch(kept.rows[i > 0 ? i - 1 : 0], 1, next - last);
      }
      last = next;
    }
  }
  for (Tally* tally : {&missing, &outside, &repeated, &backward, &leaping, &truncated, &gaps}) {
    tally->report(defects);
  }
  return kept;
}

/// The unit in which a time was meant that is `factor` times what it should be.
std::string_view unit_mistaken(double factor) {
  struct Mistake {
    double factor;
    std::string_view text;
  };
  constexpr std::array kMistakes = {
      Mistake{1e3, "the period looks like milliseconds"}, Mistake{1e6, "the period looks like microseconds"},
      Mistake{1e-3, "the times t_s look like milliseconds"}, Mistake{1e-6, "the times t_s look like microseconds"}};
  constexpr double kNear = 0.3;
  const auto* const found = std::ranges::find_if(
      kMistakes, [&](const Mistake& mistake) { return std::abs(factor / mistake.factor - 1) < kNear; });
  return found == kMistakes.end() ? "one of them is wrong" : found->text;
}

/// How many rows in a row have the same time, in the mean.
double rows_of_a_time(const Series& series) {
  std::size_t times = 1;
  for (std::size_t row = 1; row < series.rows(); ++row) {
    times += series.t_s[row] == series.t_s[row - 1] ? 0 : 1;
  }
  return static_cast<double>(series.rows()) / static_cast<double>(times);
}

/// Refuses a table that does not fit the period that it is told to have. Gaps and dropouts do not matter, be they most
/// of the pass: it is refused where hardly any step is as short as twice that period, or few are as long as half of it.
void check_period(const Series& series, const std::vector<Time>& t, Duration told, std::string_view section,
                  const std::filesystem::path& settings_file) {
  constexpr std::size_t kLeastSteps = 20;
  constexpr double kFactor = 2;
  constexpr double kHardlyAny = 0.01;
  constexpr double kFew = 0.1;
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < t.size(); ++i) {
    steps.push_back(t[i] - t[i - 1]);
  }
  if (steps.size() < kLeastSteps) {
    return;
  }
  const auto step_at = [&](double part) {
    const auto place = steps.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(steps.size() - 1));
    std::ranges::nth_element(steps, place);
    return to_seconds(*place);
  };
  const double told_s = to_seconds(told);
  if (step_at(kHardlyAny) <= kFactor * told_s && step_at(1 - kFew) >= told_s / kFactor) {
    return;
  }
  const double measured_s = step_at(0.5);
  constexpr double kPackets = 1.5;
  if (const double rows = rows_of_a_time(series); rows > kPackets) {
    throw InputRefused(
        series.file, {},
        fmt::format(
            "{} has about {:.0f} rows of the same t_s, and another t_s every {:g} s, as of packets; period_s in "
            "[{}] of {} is {:g} s",
            series.name, rows, measured_s, section, settings_file.string(), told_s),
        "give each row the time at which it was taken, such as that of the packet and period_s more for "
        "each further row");
  }
  throw InputRefused(
      series.file, {},
      fmt::format("{} has a row every {:g} s, and period_s in [{}] of {} is {:g} s: {}", series.name, measured_s,
                  section, settings_file.string(), told_s, unit_mistaken(told_s / measured_s)),
      fmt::format("both are in seconds: set period_s = {:g} there, or correct t_s", measured_s));
}

/// Leaves the rows that stay, in place.
void compact(Series& series, const Kept& kept) {
  const std::size_t width = series.columns.size();
  if (kept.rows.size() == series.rows()) {
    return;
  }
  for (std::size_t i = 0; i < kept.rows.size(); ++i) {
    std::copy_n(series.row(kept.rows[i]), width, series.values.begin() + static_cast<std::ptrdiff_t>(i * width));
  }
  series.values.resize(kept.rows.size() * width);
}

enum class Norm { kGood, kMissing, kZero, kWrong };

template <int Size>
Norm judge_norm(const double* v) {
  const double norm = Eigen::Map<const Eigen::Matrix<double, Size, 1>>(v).norm();
  if (!std::isfinite(norm)) {
    return Norm::kMissing;
  }
  if (norm == 0) {
    return Norm::kZero;
  }
  return std::abs(norm - 1) <= kNormTolerance ? Norm::kGood : Norm::kWrong;
}

/// Tallies of the three ways in which a norm can be bad.
struct NormTallies {
  Tally missing;
  Tally zero;
  Tally wrong;

  NormTallies(const Series& series, const std::string& where)
      : missing(series, Defect::Kind::kMissingValue, where),
        zero(series, Defect::Kind::kZeroNorm, where),
        wrong(series, Defect::Kind::kWrongNorm, where) {}

  void add(Norm norm, std::size_t row) {
    switch (norm) {
      case Norm::kGood:
        return;
      case Norm::kMissing:
        missing.add(row);
        return;
      case Norm::kZero:
        zero.add(row);
        return;
      case Norm::kWrong:
        wrong.add(row);
        return;
    }
  }
  void report(std::vector<Defect>& defects) {
    missing.report(defects);
    zero.report(defects);
    wrong.report(defects);
  }
};

/// Calls `stretch(first, last)` for each run of neighbouring samples of which `joined(i)` says that i belongs to the
/// run of i − 1.
template <class Joined, class Stretch>
void for_each_run(std::size_t size, Joined joined, Stretch stretch) {
  std::size_t first = 0;
  for (std::size_t i = 1; i <= size; ++i) {
    if (i == size || !joined(i)) {
      stretch(first, i - 1);
      first = i;
    }
  }
}

void screen_one_gyro(const Series& series, const Kept& kept, std::size_t gyro, std::vector<Defect>& defects) {
  const std::string where = fmt::format("{}, gyro {}", series.name, gyro + 1);
  const auto direction = [&](std::size_t i) { return series.row(kept.rows[i]) + gyro * 3; };
  NormTallies norms(series, where);
  Tally stuck(series, Defect::Kind::kStuckSamples, where);
  Tally silent(series, Defect::Kind::kSilentGyro, where);

  const std::size_t size = kept.rows.size();
  std::vector<char> usable(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Norm norm = judge_norm<3>(direction(i));
    usable[i] = norm == Norm::kGood ? 1 : 0;
    if (norm != Norm::kGood) {
      norms.add(norm, kept.rows[i]);
    }
  }
  if (std::ranges::count(usable, 1) == 0) {
    throw InputRefused(series.file, {},
                       fmt::format("{} is silent all pass long: not one of its directions is a unit vector", where),
                       cure_of_directions(series, kept.rows, gyro, "leave this gyro out, or repair its telemetry"));
  }
  const auto length = [&](std::size_t first, std::size_t last) { return kept.t[last] - kept.t[first]; };
  for_each_run(
      size,
      [&](std::size_t i) { return usable[i] != 0 && std::equal(direction(i), direction(i) + 3, direction(i - 1)); },
      [&](std::size_t first, std::size_t last) {
        if (const std::size_t count = last - first + 1; count >= kStuckSamples && usable[first] != 0) {
          stuck.add_stretch(kept.rows[first], static_cast<std::int64_t>(count), length(first, last));
        }
      });
  for_each_run(
      size, [&](std::size_t i) { return usable[i] == usable[i - 1]; },
      [&](std::size_t first, std::size_t last) {
        if (usable[first] == 0 && length(first, last) >= kSilence) {
          silent.add_stretch(kept.rows[first], 1, length(first, last));
        }
      });
  norms.report(defects);
  stuck.report(defects);
  silent.report(defects);
}

/// No two rotors have the same noise: readings that are alike sample after sample are of one gyro.
void refuse_a_copy(const Series& series, const Kept& kept, std::size_t one, std::size_t other) {
  constexpr double kMost = 0.9;
  std::size_t both = 0;
  std::size_t equal = 0;
  for (const std::size_t row : kept.rows) {
    const double* const a = series.row(row) + one * 3;
    const double* const b = series.row(row) + other * 3;
    if (judge_norm<3>(a) == Norm::kGood && judge_norm<3>(b) == Norm::kGood) {
      ++both;
      equal += std::equal(a, a + 3, b) ? 1U : 0U;
    }
  }
  if (both > 0 && static_cast<double>(equal) > kMost * static_cast<double>(both)) {
    throw InputRefused(
        series.file, {},
        fmt::format("gyro {} has the readings of gyro {}, {} of {} to the last digit", other + 1, one + 1, equal, both),
        fmt::format("give those of gyro {}, or leave it out", other + 1));
  }
}

/// Of a row of a star tracker, whose quaternion comes first; not told where it is no covariance, or an impossible one.
FixCovariance covariance_of(const double* row, std::size_t columns) {
  constexpr std::size_t kQuaternion = 4;
  constexpr double kLeastDeterminant = 1e-9;  // of the correlations: rounding alone leaves less of a singular matrix
  FixCovariance its;
  std::copy_n(row + kQuaternion, columns - kQuaternion, its.rad2.begin());
  const Eigen::Matrix3d covariance = its.matrix();
  const Eigen::Vector3d sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::Matrix3d correlation = covariance.cwiseQuotient(sigma * sigma.transpose());
  const bool is_usual =
      std::ranges::all_of(sigma, [](double value) { return limits::kStarTrackerNoise_rad.holds(value); });
  const bool is_positive = std::abs(correlation(0, 1)) < 1 && correlation.determinant() > kLeastDeterminant;
  return is_usual && is_positive ? its : FixCovariance{};
}

}  // namespace

std::vector<std::size_t> longest_increasing(const std::vector<Time>& t, std::vector<std::size_t> rows) {
  const auto not_increasing = [&](std::size_t a, std::size_t b) { return t[a] >= t[b]; };
  if (std::ranges::adjacent_find(rows, not_increasing) == rows.end()) {
    return rows;
  }
  // Longest increasing subsequence by patience sorting: one corrupt time stamp costs one row, not all that follow it.
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> tails;  // tails[n]: the row with the earliest time that ends n + 1 increasing ones
  std::vector<std::size_t> previous(t.size(), kNone);
  for (const std::size_t row : rows) {
    const auto place = std::ranges::lower_bound(tails, t[row], {}, [&](std::size_t tail) { return t[tail]; });
    if (place != tails.end() && t[*place] == t[row]) {
      continue;
    }
    previous[row] = place == tails.begin() ? kNone : *std::prev(place);
    if (place == tails.end()) {
      tails.push_back(row);
    } else {
      *place = row;
    }
  }
  std::vector<std::size_t> longest;
  for (std::size_t row = tails.empty() ? kNone : tails.back(); row != kNone; row = previous[row]) {
    longest.push_back(row);
  }
  std::ranges::reverse(longest);
  return longest;
}

GyroTelemetry screen_gyro(Series series, const PassSettings& settings, const std::filesystem::path& settings_file,
                          std::vector<Defect>& defects) {
  Kept kept = keep_increasing(series, settings, settings.gyro_period, defects,
                              [&](const std::vector<std::size_t>& rows, const std::vector<Time>& t) {
                                return rows_of_another_time(series, rows, t, settings.gyro_period);
                              });
  if (kept.t.empty()) {
    throw InputRefused(series.file, {}, fmt::format("{} has no samples with a time inside the pass", series.name),
                       "give gyro telemetry; check t_s, epoch_tai and duration_s");
  }
  if (kept.t.back() - kept.t.front() + settings.gyro_period < kShortestPass) {
    throw InputRefused(series.file, {}, fmt::format("{} covers less than a minute", series.name),
                       "give a longer pass: nothing can be calibrated");
  }
  check_period(series, kept.t, settings.gyro_period, "gyro", settings_file);
  const std::size_t gyros = series.columns.size() / 3;
  for (std::size_t gyro = 0; gyro < gyros; ++gyro) {
    screen_one_gyro(series, kept, gyro, defects);
    for (std::size_t before = 0; before < gyro; ++before) {
      refuse_a_copy(series, kept, before, gyro);
    }
  }
  compact(series, kept);
  return {static_cast<int>(gyros), std::move(kept.t), std::move(series.values)};
}

StarTrackerTelemetry screen_star_tracker(Series series, const PassSettings& settings,
                                         const std::filesystem::path& settings_file, std::vector<Defect>& defects) {
  Kept kept = keep_increasing(
      series, settings, settings.star_tracker_period, defects,
      [](const std::vector<std::size_t>&, const std::vector<Time>&) { return std::vector<std::size_t>{}; });
  check_period(series, kept.t, settings.star_tracker_period, "star_tracker", settings_file);
  NormTallies norms(series, series.name);
  Tally flips(series, Defect::Kind::kSignFlip, series.name);
  Tally without(series, Defect::Kind::kNoCovariance, series.name);
  const std::size_t columns = series.columns.size();
  StarTrackerTelemetry fixes;
  std::size_t usable = 0;
  bool comparable = false;  // over a gap, or after a bad fix, a change of hemisphere can be true motion
  for (std::size_t i = 0; i < kept.rows.size(); ++i) {
    const double* row = series.row(kept.rows[i]);
    const Eigen::Quaterniond q_in_c(row[3], row[0], row[1], row[2]);
    const Norm norm = judge_norm<4>(row);
    norms.add(norm, kept.rows[i]);
    if (norm == Norm::kGood && comparable && kept.t[i] - kept.t[i - 1] < 2 * settings.star_tracker_period &&
        q_in_c.dot(fixes.q_in_c.back()) < 0) {
      flips.add(kept.rows[i]);
    }
    comparable = norm == Norm::kGood;
    usable += comparable ? 1 : 0;
    fixes.q_in_c.push_back(q_in_c);
    if (columns > std::size_t{4}) {
      fixes.covariances.push_back(covariance_of(row, columns));
      if (!fixes.covariances.back().is_told()) {
        without.add(kept.rows[i]);
      }
    }
  }
  if (usable == 0) {
    throw InputRefused(series.file, {}, fmt::format("{} has no fix at all that can be used", series.name),
                       cure_of_quaternions(series, kept.rows,
                                           "give star-tracker telemetry: unit quaternions at times inside the pass"));
  }
  norms.report(defects);
  flips.report(defects);
  without.report(defects);
  fixes.t = std::move(kept.t);
  return fixes;
}

}  // namespace trihedron::io
