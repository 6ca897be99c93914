#pragma once
/// Time series for drawing: few enough points for a screen, and no extreme lost.

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace trihedron::report {

/// Rows, ascending, that a drawing of `channels` over `t` needs: in each of `buckets` equal stretches of time the rows
/// where a channel has its least and greatest value, and the first row with a NaN, which is a gap; also the first and
/// last row of all. `t` ascends and is finite; every channel is as long as `t`.
[[nodiscard]] std::vector<std::size_t> decimate(std::span<const double> t,
                                                std::span<const std::vector<double>> channels, std::size_t buckets);

/// `value` to so many significant digits: what a figure can show, in fewer bytes.
[[nodiscard]] double rounded(double value, int digits);

/// Values over time with gaps.
class Series {
 public:
  /// Rows further apart than `longest_step` (in the unit of time of the rows) get a gap between them.
  Series(std::size_t channels, double longest_step);

  void add(double t, std::initializer_list<double> row);
  [[nodiscard]] bool empty() const { return t_.empty(); }
  [[nodiscard]] const std::vector<double>& t() const { return t_; }
  [[nodiscard]] const std::vector<double>& channel(std::size_t i) const { return channels_[i]; }

  /// {"t": […], "y": [[…], …]} of the decimated series; null is a gap.
  [[nodiscard]] nlohmann::json drawn(std::size_t buckets) const;

 private:
  double longest_step_;
  std::vector<double> t_;
  std::vector<std::vector<double>> channels_;
};

}  // namespace trihedron::report
