#include "pack.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "filters.hpp"
#include "simulation.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::lanes {
namespace {

/// The polynomial through the samples of these times since the fix, as DirectionsFit has it.
class FitOfTimes {
 public:
  /// Samples `first` to `last`, counted from that of the fix.
  FitOfTimes(int first, int last, double period_s) {
    const int count = last - first + 1;
    if (count < DirectionsFit::least_samples(kTerms - 1)) {
      return;
    }
    fit_.count = count;
    fit_.terms = std::clamp((count + 2) / 3, 1, kTerms);
    fit_.reach_s = std::max(std::abs(first), std::abs(last)) * period_s;
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    normal.diagonal().tail(kTerms - fit_.terms).setOnes();
    for (int i = first; i <= last; ++i) {
      const double x = i * period_s / fit_.reach_s;
      std::array<double, kTerms>& powers = powers_.emplace_back();
      double power = 1;
      for (int term = 0; term < fit_.terms; ++term) {
        powers[static_cast<std::size_t>(term)] = power;
        power *= x;
      }
      const Eigen::Map<const Eigen::Vector4d> its(powers.data());
      normal += its * its.transpose();
    }
    const Eigen::Matrix<double, kTerms, kTerms> L = normal.llt().matrixL();
    Eigen::Map<Eigen::Matrix<double, kTerms, kTerms, Eigen::RowMajor>>(&fit_.L[0][0]) = L;
    const Eigen::Vector4d at_zero = L.triangularView<Eigen::Lower>().solve(Eigen::Vector4d::UnitX());
    fit_.noise_factor = at_zero.norm();
  }

  /// Through these samples.
  [[nodiscard]] Fit through(const V3 (*samples)[kGyros]) const {
    Fit fit = fit_;
    fit.samples = samples;
    fit.powers = reinterpret_cast<const double(*)[kTerms]>(powers_.data());
    return fit;
  }

 private:
  Fit fit_;
  std::vector<std::array<double, kTerms>> powers_;
};
}  // namespace

std::vector<std::optional<FilterResult>> fly_pack(std::span<Lane* const> lanes, const Kernels& kernels) {
  constexpr std::size_t kKept = 256;  // samples
  static_assert(kKept > 2 * Readings<kGyros>::kCapacity);
  const Scenario& scenario = *lanes.front()->scenario;
  const CalibrationSetup& setup = lanes.front()->estimator->setup();
  const double period_s = to_seconds(scenario.gyro_period);
  const auto reach = static_cast<int>(setup.reach() / scenario.gyro_period);
  const auto samples = static_cast<int>(scenario.duration / scenario.gyro_period) + 1;
  const auto between_fixes = static_cast<int>(scenario.star_tracker_period / scenario.gyro_period);
  Simulation simulation(lanes, kernels);
  Filters filters(lanes, kernels);
  // Twice, so that those around any sample lie one after the other.
  std::vector<Kept> kept(2 * kKept);
  std::vector<M3> truth(kKept);  // at fixes
  const auto at = [&](int sample) { return static_cast<std::size_t>(sample) % kKept; };
  int simulated = 0;
  int fit_first = 1;
  int fit_last = -1;
  std::optional<FitOfTimes> fit;
  for (int i = 0; i < samples; ++i) {
    for (; simulated <= std::min(i + reach, samples - 1); ++simulated) {
      Kept& its = kept[at(simulated)];
      simulation.next(its.h_b);
      kept[at(simulated) + kKept] = its;
      if (simulated % between_fixes == 0) {
        truth[at(simulated)] = simulation.C_in_c();
      }
    }
    const Kept& its = kept[at(i)];
    filters.predict(its.h_b, i == 0 ? 0 : period_s);
    if (i % between_fixes != 0) {
      continue;
    }
    check_stop();
    const int first = std::max(-reach, -i);
    const int last = std::min(reach, samples - 1 - i);
    if (!fit || first != fit_first || last != fit_last) {
      fit.emplace(first, last, period_s);
      fit_first = first;
      fit_last = last;
    }
    // All that the on-board step keeps.
    const int kept_before = std::min(i, Readings<kGyros>::kCapacity - 1 - last);
    const Kept* of_fix = &kept[at(i - kept_before) + static_cast<std::size_t>(kept_before)];
    filters.fix(scenario.epoch + i * scenario.gyro_period, fit->through(&of_fix[first].h_b),
                {of_fix, -kept_before, last, scenario.gyro_period}, truth[at(i)]);
    if (filters.have_all_left()) {
      break;
    }
  }
  filters.end(scenario.epoch + (samples - 1) * scenario.gyro_period);
  std::vector<std::optional<FilterResult>> results;
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    results.push_back(filters.result(i));
  }
  return results;
}

}  // namespace trihedron::lanes
