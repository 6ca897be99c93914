#include "trihedron/ground/inspect/mistakes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <utility>

namespace trihedron::ground {
namespace {

using ComponentOrder = std::array<SignedComponent, 4>;
using AxisOrder = std::array<SignedComponent, 3>;

constexpr ComponentOrder kAsTold = {{{0, 1}, {1, 1}, {2, 1}, {3, 1}}};

/// A fix and the readings at its time.
struct Sight {
  Eigen::Quaterniond q_in_c;
  PerGyro<Eigen::Vector3d> h_b{};  ///< of length 1; NaN where there is none
};

/// 20 minutes of them.
using Window = std::vector<Sight>;

constexpr Duration kWindow = std::chrono::minutes(20);
constexpr std::size_t kMostWindows = 12;
constexpr std::size_t kMostSights = 40;  // of a window
constexpr std::size_t kFewestSights = 10;
constexpr double kShare = 0.8;  // of the fixes: one of five may be an outlier
/// A mistake explains what it lessens by this factor at least: wrong hypotheses lessen it by chance, by less than 2.
constexpr double kExplains = 4;
/// A clock that is off is told from here on: less is found and corrected by the calibration.
constexpr double kClock_s = 0.5;
constexpr double kClockSigmas = 5;

/// Readings interpolated at t, of length 1; NaN where there is none within 1.5 periods.
Eigen::Vector3d direction_at(const Pass& pass, Time t, int gyro) {
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const std::vector<Time>& times = pass.gyro.t;
  const auto after = std::ranges::lower_bound(times, t);
  if (after == times.end() || (after == times.begin() && *after != t)) {
    return none;
  }
  const auto i = static_cast<std::size_t>(after - times.begin());
  const std::size_t before = *after == t ? i : i - 1;
  const Duration step = times[i] - times[before];
  if (2 * step > 3 * pass.settings.gyro_period) {
    return none;
  }
  const double part = step > Duration::zero() ? to_seconds(t - times[before]) / to_seconds(step) : 0;
  const Eigen::Vector3d h = (1 - part) * pass.gyro.direction(before, gyro) + part * pass.gyro.direction(i, gyro);
  return std::abs(h.norm() - 1) < 0.01 ? Eigen::Vector3d(h.normalized()) : none;
}

/// Windows that are spread over the pass, with fixes that are spread over each. `offset`: a fix gives the attitude so
/// long after its stamp.
std::vector<Window> windows_of(const Pass& pass, Duration offset) {
  const StarTrackerTelemetry& fixes = pass.star_tracker;
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  for (std::size_t first = 0, i = 0; i <= fixes.size() && !fixes.t.empty(); ++i) {
    if (i == fixes.size() || fixes.t[i] - fixes.t[first] >= kWindow) {
      ranges.emplace_back(first, i);
      first = i;
    }
  }
  std::vector<Window> windows;
  const std::size_t every = ranges.size() / kMostWindows + 1;
  for (std::size_t r = 0; r < ranges.size(); r += every) {
    const auto [first, last] = ranges[r];
    const std::size_t step = (last - first) / kMostSights + 1;
    Window window;
    for (std::size_t i = first; i < last; i += step) {
      const Eigen::Quaterniond& q = fixes.q_in_c[i];
      if (!(std::abs(q.norm() - 1) < 0.01)) {
        continue;
      }
      Sight sight;
      sight.q_in_c = q.normalized();
      for (int k = 0; k < pass.gyro.gyros; ++k) {
        sight.h_b[k] = direction_at(pass, fixes.t[i] + offset, k);
      }
      window.push_back(sight);
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

Eigen::Quaterniond put_in_order(const Eigen::Quaterniond& q, const ComponentOrder& components) {
  const std::array<double, 4> told = {q.x(), q.y(), q.z(), q.w()};
  const auto at = [&](std::size_t i) {
    return components[i].sign * told[static_cast<std::size_t>(components[i].from)];
  };
  return {at(3), at(0), at(1), at(2)};
}

Eigen::Vector3d put_in_order(const Eigen::Vector3d& h, const AxisOrder& axes) {
  return {axes[0].sign * h(axes[0].from), axes[1].sign * h(axes[1].from), axes[2].sign * h(axes[2].from)};
}

Eigen::Matrix3d rotation(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

/// How far a direction moves, one for each sight; as Consistency::motion_rad. NaN where there are too few.
template <class Direction>
double motion(const std::vector<Window>& windows, const Direction& direction) {
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> directions;
  for (const Window& window : windows) {
    directions.clear();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Sight& sight : window) {
      const Eigen::Vector3d u = direction(sight);
      if (u.allFinite()) {
        directions.push_back(u);
        sum += u;
      }
    }
    if (directions.size() < kFewestSights) {
      continue;
    }
    for (const Eigen::Vector3d& u : directions) {
      angles.push_back(std::atan2(u.cross(sum).norm(), u.dot(sum)));
    }
  }
  if (angles.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto place = angles.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(angles.size() - 1));
  std::ranges::nth_element(angles, place);
  return *place;
}

/// Which gyro's alignment, axes and readings are taken for each gyro.
class Scene {
 public:
  explicit Scene(const Pass& pass) : pass_(pass), windows_(windows_of(pass, Duration::zero())) {
    for (int k = 0; k < gyros(); ++k) {
      const GyroPrior& prior = pass.settings.gyros[static_cast<std::size_t>(k)];
      const bool has_calibration = pass.settings.prior.has_value();
      C_c_b_[k] = rotation(has_calibration
                               ? pass.settings.prior->gyros[static_cast<std::size_t>(k)].alignment_rotation_vector_rad
                               : prior.alignment_rotation_vector_rad);
      // As the body turns, an alignment that is off by δ moves a momentum by up to |δ| from its mean, drift κ by a few
      // |κ| times half a window; both to three sigmas. Nothing is judged below half a degree.
      constexpr double kSigmas = 3;
      constexpr double kLeast_rad = 0.01;
      constexpr double kCoefficients = 7;
      const double drift_rad = std::sqrt(kCoefficients) * prior.drift_common_sigma_rad_s * to_seconds(kWindow) / 2;
      allowed_rad_[k] = kLeast_rad + kSigmas * (prior.alignment_sigma_rad.norm() + drift_rad);
      motion_rad_[k] = motion_of(k, kAsTold);
    }
  }

  [[nodiscard]] int gyros() const {
    return std::min({pass_.gyro.gyros, static_cast<int>(pass_.settings.gyros.size()), kMaxGyros});
  }
  [[nodiscard]] const PerGyro<double>& motion_rad() const { return motion_rad_; }
  [[nodiscard]] const PerGyro<double>& allowed_rad() const { return allowed_rad_; }
  [[nodiscard]] bool is_usable() const {
    for (int k = 0; k < gyros(); ++k) {
      if (std::isfinite(motion_rad_[k])) {
        return true;
      }
    }
    return false;
  }
  /// NaN counts as good: it says nothing.
  [[nodiscard]] bool is_good(int gyro) const { return !(motion_rad_[gyro] > allowed_rad_[gyro]); }
  [[nodiscard]] bool explains(int gyro, double motion_rad) const {
    return !(motion_rad > allowed_rad_[gyro]) && !(kExplains * motion_rad > motion_rad_[gyro] && !is_good(gyro));
  }

  [[nodiscard]] double motion_of(int gyro, const ComponentOrder& components) const {
    return motion(windows_, [&](const Sight& sight) -> Eigen::Vector3d {
      return put_in_order(sight.q_in_c, components) * (C_c_b_[gyro] * sight.h_b[gyro]);
    });
  }
  [[nodiscard]] double motion_of(int gyro, const AxisOrder& axes) const {
    return motion(windows_, [&](const Sight& sight) -> Eigen::Vector3d {
      return sight.q_in_c * (C_c_b_[gyro] * put_in_order(sight.h_b[gyro], axes));
    });
  }
  /// With the readings of another gyro.
  [[nodiscard]] double motion_of(int gyro, int readings) const {
    return motion(windows_, [&](const Sight& sight) -> Eigen::Vector3d {
      return sight.q_in_c * (C_c_b_[gyro] * sight.h_b[readings]);
    });
  }
  [[nodiscard]] double motion_late(int gyro, double offset_s) const {
    if (late_.empty()) {
      late_ = windows_of(pass_, from_seconds(offset_s));
    }
    return motion(
        late_, [&](const Sight& sight) -> Eigen::Vector3d { return sight.q_in_c * (C_c_b_[gyro] * sight.h_b[gyro]); });
  }
  /// The largest over the gyros where it explains each of them, else nothing.
  template <class MotionOf>
  [[nodiscard]] std::optional<double> explained(const MotionOf& motion_of_gyro) const {
    double largest = 0;
    for (int k = 0; k < gyros(); ++k) {
      if (!std::isfinite(motion_rad_[k])) {
        continue;
      }
      const double left = motion_of_gyro(k);
      if (!std::isfinite(left) || !explains(k, left)) {
        return std::nullopt;
      }
      largest = std::max(largest, left);
    }
    return largest;
  }

 private:
  const Pass& pass_;
  std::vector<Window> windows_;
  mutable std::vector<Window> late_;
  PerGyro<Eigen::Matrix3d> C_c_b_{};
  PerGyro<double> allowed_rad_{};
  PerGyro<double> motion_rad_{};
};

// ---- Hypotheses. The sign of a quaternion as a whole means nothing, nor does a momentum that is turned round.

/// All orders and signs of so many components, without those that differ by all signs.
template <std::size_t Size>
std::vector<std::array<SignedComponent, Size>> all_arrangements() {
  std::vector<std::array<SignedComponent, Size>> all;
  std::array<int, Size> order{};
  for (std::size_t i = 0; i < Size; ++i) {
    order[i] = static_cast<int>(i);
  }
  do {
    for (unsigned signs = 0; signs < (1U << Size); ++signs) {
      std::array<SignedComponent, Size> one{};
      for (std::size_t i = 0; i < Size; ++i) {
        one[i] = {order[i], (signs >> i & 1U) != 0 ? -1 : 1};
      }
      all.push_back(one);
    }
  } while (std::ranges::next_permutation(order).found);
  return all;
}

/// How unusual an arrangement is: 2 for each mistake that it takes. Of a quaternion these are the scalar at the other
/// end, conjugate (1 beside the first, which often come together), axes in another order, and each axis mirrored.
int cost_of(const ComponentOrder& components) {
  const bool is_scalar_as_told = components[3].from == 3;
  int moved = 0;
  int minus = 0;
  for (int i = 0; i < 3; ++i) {
    const SignedComponent& part = components[static_cast<std::size_t>(i)];
    moved += axis_of(part, components[3].from) != i ? 1 : 0;
    minus += part.sign != components[3].sign ? 1 : 0;
  }
  const int conjugate = is_scalar_as_told ? 2 : 1;
  return (is_scalar_as_told ? 0 : 2) + (moved > 0 ? 2 : 0) + (minus == 3 ? conjugate : 2 * minus);
}

int cost_of(const AxisOrder& axes) {
  int moved = 0;
  int minus = 0;
  for (int i = 0; i < 3; ++i) {
    moved += axes[static_cast<std::size_t>(i)].from != i ? 1 : 0;
    minus += axes[static_cast<std::size_t>(i)].sign < 0 ? 1 : 0;
  }
  return (moved > 0 ? 2 : 0) + 2 * minus;
}

template <class Arrangement>
struct Explanation {
  Arrangement arrangement;
  double motion_rad = 0;  ///< that is left
};

/// What leaves more than this times the least that is left explains nothing.
template <class List>
void keep_the_best(List& list) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& one : list) {
    least = std::min(least, one.motion_rad);
  }
  std::erase_if(list, [least](const auto& one) { return one.motion_rad > kExplains * least; });
}

/// Of those arrangements that explain, the least unusual ones.
template <class Arrangement, class Explained>
std::vector<Explanation<Arrangement>> usual_explanations(const std::vector<Arrangement>& all,
                                                         const Explained& explained) {
  std::vector<Explanation<Arrangement>> found;
  for (const Arrangement& arrangement : all) {
    if (const std::optional<double> left = explained(arrangement); left && cost_of(arrangement) > 0) {
      found.push_back({arrangement, *left});
    }
  }
  keep_the_best(found);
  int least = std::numeric_limits<int>::max();
  for (const auto& one : found) {
    least = std::min(least, cost_of(one.arrangement));
  }
  std::erase_if(found, [least](const auto& one) { return cost_of(one.arrangement) > least; });
  return found;
}

void try_quaternions(const Scene& scene, std::vector<Mistake>& mistakes) {
  std::vector<ComponentOrder> all;
  // No format has the scalar second, and all signs turned mean the same rotation.
  for (const ComponentOrder& components : all_arrangements<4>()) {
    if (components[3].sign > 0 && components[3].from != 1) {
      all.push_back(components);
    }
  }
  const auto found = usual_explanations(all, [&](const ComponentOrder& components) {
    return scene.explained([&](int k) { return scene.motion_of(k, components); });
  });
  for (const auto& [components, left] : found) {
    mistakes.push_back({Mistake::Kind::kQuaternion, 0, components, 0, left});
  }
}

void try_gyro_axes(const Scene& scene, std::vector<Mistake>& mistakes) {
  for (int k = 0; k < scene.gyros(); ++k) {
    if (scene.is_good(k)) {
      continue;
    }
    const auto found = usual_explanations(all_arrangements<3>(), [&](const AxisOrder& axes) -> std::optional<double> {
      const double left = scene.motion_of(k, axes);
      return scene.explains(k, left) ? std::optional(left) : std::nullopt;
    });
    for (const auto& [axes, left] : found) {
      mistakes.push_back({Mistake::Kind::kGyroAxes, k, {axes[0], axes[1], axes[2], {}}, 0, left});
    }
  }
}

}  // namespace

std::optional<Consistency> consistency_of(const Pass& pass, const std::optional<Clocks>& clocks) {
  const Scene scene(pass);
  if (!scene.is_usable()) {
    return std::nullopt;
  }
  Consistency result{scene.motion_rad(), scene.allowed_rad(), true, {}};
  bool is_any_good = false;
  for (int k = 0; k < scene.gyros(); ++k) {
    const bool is_known = std::isfinite(scene.motion_rad()[k]);
    result.is_consistent = result.is_consistent && scene.is_good(k);
    is_any_good = is_any_good || (is_known && scene.is_good(k));
  }
  std::vector<Mistake>& mistakes = result.mistakes;
  const bool clock_is_off =
      clocks && std::abs(clocks->mid_offset_s.value) > std::max(kClock_s, kClockSigmas * clocks->mid_offset_s.sigma);
  if (clock_is_off) {
    const double offset_s = clocks->mid_offset_s.value;
    const auto left = scene.explained([&](int k) { return scene.motion_late(k, offset_s); });
    if (left) {
      mistakes.push_back({Mistake::Kind::kClock, 0, kAsTold, offset_s, *left});
      return result;
    }
  }
  if (result.is_consistent) {
    return result;
  }
  // All are tried, because in steady flight a mistake of one can look like a mistake of the other.
  try_quaternions(scene, mistakes);
  if (is_any_good) {
    try_gyro_axes(scene, mistakes);
  }
  if (const auto left = scene.explained([&](int k) { return scene.motion_of(k, k > 1 ? k : 1 - k); })) {
    mistakes.push_back({Mistake::Kind::kGyrosExchanged, 0, kAsTold, 0, *left});
  }
  keep_the_best(mistakes);
  if (mistakes.empty()) {
    mistakes.push_back({Mistake::Kind::kNothingTried, 0, kAsTold, 0, std::numeric_limits<double>::quiet_NaN()});
  }
  return result;
}

}  // namespace trihedron::ground
