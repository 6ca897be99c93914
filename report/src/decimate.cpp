#include "decimate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace trihedron::report {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr int kDigits = 5;
constexpr double kTimeStepsPerUnit = 1000;

/// Appends rows of one bucket, [begin, end), in their order, some more than once.
void keep_extremes(std::span<const std::vector<double>> channels, std::size_t begin, std::size_t end,
                   std::vector<std::size_t>& keep) {
  const std::size_t before = keep.size();
  for (const std::vector<double>& channel : channels) {
    std::size_t least = end;
    std::size_t greatest = end;
    bool has_gap = false;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(channel[i])) {
        if (!has_gap) {
          keep.push_back(i);
        }
        has_gap = true;
        continue;
      }
      least = least == end || channel[i] < channel[least] ? i : least;
      greatest = greatest == end || channel[i] > channel[greatest] ? i : greatest;
    }
    if (least != end) {
      keep.push_back(least);
      keep.push_back(greatest);
    }
  }
  std::ranges::sort(keep.begin() + static_cast<std::ptrdiff_t>(before), keep.end());
}

}  // namespace

std::vector<std::size_t> decimate(std::span<const double> t, std::span<const std::vector<double>> channels,
                                  std::size_t buckets) {
  if (t.empty()) {
    return {};
  }
  std::vector<std::size_t> keep{0};
  const double scale = static_cast<double>(buckets) / (t.back() - t.front());
  const auto bucket_of = [&](std::size_t i) { return std::floor((t[i] - t.front()) * scale); };
  for (std::size_t begin = 0; begin < t.size();) {
    std::size_t end = begin + 1;
    while (end < t.size() && bucket_of(end) == bucket_of(begin)) {
      ++end;
    }
    keep_extremes(channels, begin, end, keep);
    begin = end;
  }
  keep.push_back(t.size() - 1);
  const auto repeated = std::ranges::unique(keep);
  keep.erase(repeated.begin(), repeated.end());
  return keep;
}

double rounded(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) {
    return value;
  }
  const double scale = std::pow(10.0, digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(value)))));
  return std::round(value * scale) / scale;
}

Series::Series(std::size_t channels, double longest_step) : longest_step_(longest_step), channels_(channels) {}

void Series::add(double t, std::initializer_list<double> row) {
  if (!t_.empty() && t - t_.back() > longest_step_) {
    t_.push_back((t_.back() + t) / 2);
    for (std::vector<double>& channel : channels_) {
      channel.push_back(kGap);
    }
  }
  t_.push_back(t);
  auto value = row.begin();
  for (std::vector<double>& channel : channels_) {
    channel.push_back(*value++);
  }
}

nlohmann::json Series::drawn(std::size_t buckets) const {
  const std::vector<std::size_t> rows = decimate(t_, channels_, buckets);
  nlohmann::json t = nlohmann::json::array();
  nlohmann::json y = nlohmann::json::array();
  for (const std::size_t row : rows) {
    t.push_back(std::round(t_[row] * kTimeStepsPerUnit) / kTimeStepsPerUnit);
  }
  for (const std::vector<double>& channel : channels_) {
    nlohmann::json column = nlohmann::json::array();
    for (const std::size_t row : rows) {
      column.push_back(rounded(channel[row], kDigits));
    }
    y.push_back(std::move(column));
  }
  return {{"t", std::move(t)}, {"y", std::move(y)}};
}

}  // namespace trihedron::report
