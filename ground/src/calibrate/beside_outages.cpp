#include "calibrate/beside_outages.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "model/scatter.hpp"
#include "model/setup.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/measurement.hpp"

namespace trihedron::ground {
namespace {

constexpr Duration kShortestOutage = std::chrono::minutes(5);
constexpr Duration kBeside = std::chrono::minutes(10);
constexpr std::ptrdiff_t kFewestOutages = 3;
constexpr int kBinMinutes = 2;
constexpr std::size_t kBins = 5;

/// Last fix before, first after.
using Outage = std::pair<Time, Time>;

std::vector<Outage> outages_of(const Pass& pass) {
  std::vector<Outage> outages;
  const std::vector<Time>& t = pass.star_tracker.t;
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] - t[i - 1] >= kShortestOutage) {
      outages.emplace_back(t[i - 1], t[i]);
    }
  }
  return outages;
}

/// Time to the outage that a fix is so near to on this side; negative where there is none.
Duration to_outage(const std::vector<Outage>& outages, Time t, bool before) {
  for (const auto& [last, first] : outages) {
    const Duration apart = before ? last - t : t - first;
    if (apart >= Duration::zero() && apart < kBeside) {
      return apart;
    }
  }
  return Duration{-1};
}

/// Errors of fixes, axis by axis, and the 1-sigmas of the attitude they were compared with.
struct Bin {
  std::array<std::vector<double>, 3> off_rad;
  std::array<std::vector<double>, 3> sigma_rad;

  struct Mean {
    double off_rad = 0;
    double sigma_rad = 0;
  };
  /// Median, and how far off it may be.
  [[nodiscard]] Mean about(std::size_t axis) const {
    constexpr std::size_t kFewestFixes = 20;
    constexpr double kMedianOverMean = 1.25;
    std::vector<double> values = off_rad[axis];
    if (values.size() < kFewestFixes) {
      return {};
    }
    const double median = median_of(values);
    for (double& value : values) {
      value = std::abs(value - median);
    }
    const double scatter = sigma_without_outliers(values) / std::sqrt(static_cast<double>(values.size()));
    std::vector<double> sigmas = sigma_rad[axis];
    return {median, std::hypot(kMedianOverMean * scatter, median_of(sigmas))};
  }
};

/// Values of the states that the gyros share.
Eigen::VectorXd shared_states(const Layout& layout, const Calibration& calibration) {
  Eigen::VectorXd shared = Eigen::VectorXd::Zero(layout.shared_size());
  for (const FurtherEstimate& estimate : calibration.further) {
    if (const int state = state_of(layout, estimate.parameter); state >= layout.shared()) {
      shared(state - layout.shared()) = estimate.value;
    }
  }
  return shared;
}

}  // namespace

std::optional<Pass> without_fixes_beside_outages(const Pass& pass, BesideOutages sides) {
  const std::vector<Outage> outages = outages_of(pass);
  if (std::ssize(outages) < kFewestOutages || !pass.further_star_trackers.empty()) {
    return std::nullopt;
  }
  Pass rest = pass;
  StarTrackerTelemetry& fixes = rest.star_tracker = {};
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    const Time t = pass.star_tracker.t[i];
    const bool is_beside = (sides.before && to_outage(outages, t, true) >= Duration::zero()) ||
                           (sides.after && to_outage(outages, t, false) >= Duration::zero());
    if (!is_beside) {
      fixes.add(pass.star_tracker, i);
    }
  }
  return 2 * fixes.size() > pass.star_tracker.size() ? std::optional(std::move(rest)) : std::nullopt;
}

std::optional<ErrorsBesideOutages> errors_beside_outages(const Pass& pass, const CalibrationRun& run) {
  constexpr double kLeastSigmas = 5;
  constexpr double kOneSided = 3;
  const std::vector<Outage> outages = outages_of(pass);
  CalibrationOptions options = run.options;  // whatever the drift model, the states that gyros share are the same
  options.drift_field = false;
  options.drift_model = kEsg7;
  const CalibrationSetup setup = setup_of(pass.settings, options);
  const Eigen::VectorXd shared = shared_states(setup.layout, run.calibration);
  const AttitudeHistory& attitude = run.definitive_attitude;
  std::array<std::array<Bin, kBins>, 2> bins;  // after, before
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    const StarFix fix = pass.star_tracker.fix(i, 0);
    const auto at = static_cast<std::size_t>(std::ranges::lower_bound(attitude.t, fix.t) - attitude.t.begin());
    if (at + 1 >= attitude.t.size() || attitude.t[at + 1] - fix.t > 2 * pass.settings.gyro_period) {
      continue;
    }
    const auto C_in_c = Rot<In, C>::assume(attitude.q_in_c[at]);
    const auto next = Rot<In, C>::assume(attitude.q_in_c[at + 1]);
    const Eigen::Vector3d rate_c =
        (C_in_c.inverse() * next).log().raw() / to_seconds(attitude.t[at + 1] - attitude.t[at]);
    const FixBySharedStates by_shared = fix_by_shared_states(setup, fix, rate_c);
    const Rot<C, C> to_fix = Rot<C, C>::exp(Vec<C>::assume(to_seconds(attitude.t[at] - fix.t) * rate_c));
    const Eigen::Vector3d off_rad =
        (C_in_c.inverse() * corrected(fix, by_shared.lazyProduct(shared)) * to_fix).log().raw();
    for (const bool before : {false, true}) {
      if (const Duration apart = to_outage(outages, fix.t, before); apart >= Duration::zero()) {
        Bin& bin = bins[before ? 1 : 0][static_cast<std::size_t>(apart / std::chrono::minutes(kBinMinutes))];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          bin.off_rad[axis].push_back(off_rad[static_cast<Eigen::Index>(axis)]);
          bin.sigma_rad[axis].push_back(attitude.sigma_rad[at][static_cast<Eigen::Index>(axis)]);
        }
      }
    }
  }
  ErrorsBesideOutages found;
  for (const bool before : {false, true}) {
    for (std::size_t n = 0; n < kBins; ++n) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Bin::Mean its = bins[before ? 1 : 0][n].about(axis);
        double on_other_side = 0;
        for (const Bin& other : bins[before ? 0 : 1]) {
          on_other_side = std::max(on_other_side, std::abs(other.about(axis).off_rad));
        }
        const double sigmas = its.sigma_rad > 0 ? std::abs(its.off_rad) / its.sigma_rad : 0;
        if (sigmas > std::max(kLeastSigmas, found.sigmas) && std::abs(its.off_rad) > kOneSided * on_other_side) {
          found = {static_cast<int>(outages.size()),
                   0,
                   before,
                   kBinMinutes * static_cast<int>(n),
                   std::abs(its.off_rad),
                   sigmas};
        }
      }
    }
  }
  return found.sigmas > 0 ? std::optional(found) : std::nullopt;
}

}  // namespace trihedron::ground
