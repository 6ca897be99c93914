#include "trihedron/plan/advise.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "design_flight.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/sim/attitude.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

using ground::SetupError;

/// A slew to an attitude, a hold there and the slew back. All excursions share the manoeuvre time equally.
struct Excursion {
  Eigen::Vector3d axis_c = Eigen::Vector3d::UnitX();
  double part_of_angle = 1;  ///< of the largest angle for which there is time; the sign is that of the turn
  double begin_s = 0;
};
using Plan = std::vector<Excursion>;

/// Axes through the corners, the middles of the edges and of the faces of a cube: 13, one of each opposite pair.
std::vector<Eigen::Vector3d> axes() {
  std::vector<Eigen::Vector3d> all;
  for (int number = 14; number < 27; ++number) {
    const Eigen::Vector3i towards(number / 9 - 1, number / 3 % 3 - 1, number % 3 - 1);
    all.emplace_back(towards.cast<double>().normalized());
  }
  return all;
}

constexpr std::array<double, 6> kPartsOfAngle = {1, -1, 0.75, -0.75, 0.5, -0.5};
constexpr int kTimes = 9;
/// Times of slews are in whole seconds.
constexpr double kRounding_s = 1;
/// Rounds of coordinate exchange; further ones improve the result by nothing that matters.
constexpr int kRounds = 2;

/// Rounded towards zero to tenths of a degree, so that a limit stays kept.
double rounded_rad(double angle_rad) {
  const double tenths = std::trunc(std::abs(angle_rad) / kDegree * 10 + 1e-6);
  return tenths > 0 ? std::copysign(tenths / 10 * kDegree, angle_rad) : 0;
}

/// The slew to the attitude that is turned about an axis, as Rz(yaw) Ry(pitch) Rx(roll).
Slew slew_to(double begin_s, const Eigen::Vector3d& axis_c, double angle_rad) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle_rad, axis_c).toRotationMatrix();
  return {begin_s, rounded_rad(std::atan2(turn(2, 1), turn(2, 2))), rounded_rad(-std::asin(turn(2, 0))),
          rounded_rad(std::atan2(turn(1, 0), turn(0, 0)))};
}

class Search {
 public:
  Search(const Scenario& scenario, const ground::Observability& steady, const SlewLimits& limits,
         const Progress& progress)
      : flight_(scenario, steady.options),
        metric_(steady.attitude_metric),
        attitude_(scenario.attitude),
        duration_s_(to_seconds(scenario.duration)),
        limits_(limits),
        progress_(progress) {}

  [[nodiscard]] std::vector<Slew> best() {
    Plan plan;
    Plan best;
    double least = errors({best}).front();
    for (int slews = 1; slews <= limits_.slews; ++slews) {
      const std::vector<double> times = free_times(plan, plan.size());
      if (times.empty()) {
        break;
      }
      plan.push_back({.begin_s = times.front()});
      for (int round = 0; round < kRounds; ++round) {
        for (std::size_t i = 0; i < plan.size(); ++i) {
          exchange(plan, i);
        }
      }
      const double mean_square = errors({plan}).front();
      if (!(mean_square < (1 - Advice::kLeastGain) * least)) {
        break;
      }
      least = mean_square;
      best = plan;
    }
    return slews_of(best);
  }

 private:
  /// Time that each of so many excursions has.
  [[nodiscard]] double share_s(std::size_t excursions) const {
    return to_seconds(limits_.manoeuvre_time) / static_cast<double>(excursions);
  }
  [[nodiscard]] double turn_s(double angle_rad) const {
    return sim::turn_duration_s(angle_rad, attitude_.max_slew_rate_rad_s, attitude_.max_slew_acceleration_rad_s2);
  }
  /// Largest angle from which there is time to come back.
  [[nodiscard]] double largest_rad(std::size_t excursions) const {
    const double whole_s = 2 * turn_s(limits_.max_angle_rad);
    const double part = std::clamp((share_s(excursions) - kRounding_s) / whole_s, 0.0, 1.0);
    // The time of a turn that is limited by acceleration grows with the root of its angle.
    return limits_.max_angle_rad * part * part;
  }

  [[nodiscard]] std::vector<Slew> slews_of(Plan plan) const {
    std::ranges::sort(plan, [](const Excursion& a, const Excursion& b) { return a.begin_s < b.begin_s; });
    std::vector<Slew> slews;
    for (const Excursion& excursion : plan) {
      const double angle_rad = excursion.part_of_angle * largest_rad(plan.size());
      slews.push_back(slew_to(excursion.begin_s, excursion.axis_c, angle_rad));
      slews.push_back({.begin_s = std::floor(excursion.begin_s + share_s(plan.size()) - turn_s(angle_rad))});
    }
    return slews;
  }

  /// Times at which an excursion may begin without touching the others.
  [[nodiscard]] std::vector<double> free_times(const Plan& plan, std::size_t excursion) const {
    const double share = share_s(std::max(plan.size(), excursion + 1));
    std::vector<double> times;
    for (int i = 0; i < kTimes; ++i) {
      const double begin_s = std::floor((i + 0.5) / kTimes * (duration_s_ - share));
      bool is_free = true;
      for (std::size_t other = 0; other < plan.size(); ++other) {
        is_free = is_free && (other == excursion || std::abs(plan[other].begin_s - begin_s) >= share);
      }
      if (is_free) {
        times.push_back(begin_s);
      }
    }
    return times;
  }

  /// Coordinate exchange: axis, angle and time of one excursion, one after the other, each set to the best of its
  /// values while everything else stays.
  void exchange(Plan& plan, std::size_t excursion) {
    const auto vary = [&](const auto& values, const auto member) {
      std::vector<Plan> candidates{plan};
      for (const auto& value : values) {
        candidates.push_back(plan);
        candidates.back()[excursion].*member = value;
      }
      const std::vector<double> squares = errors(candidates);
      plan = candidates[static_cast<std::size_t>(std::ranges::min_element(squares) - squares.begin())];
    };
    vary(axes(), &Excursion::axis_c);
    vary(kPartsOfAngle, &Excursion::part_of_angle);
    vary(free_times(plan, excursion), &Excursion::begin_s);
  }

  /// Mean square of the attitude error that each plan leaves. The search comes back to many a plan.
  [[nodiscard]] std::vector<double> errors(const std::vector<Plan>& plans) {
    std::vector<std::vector<Slew>> unknown;
    for (const Plan& plan : plans) {
      if (std::vector<Slew> slews = slews_of(plan); known_.try_emplace(key_of(slews)).second) {
        unknown.push_back(std::move(slews));
      }
    }
    const std::vector<double> found = ground::on_all_cores(
        unknown.size(), [&](std::size_t i) { return (metric_ * flight_.covariance_after(unknown[i])).trace(); });
    for (std::size_t i = 0; i < unknown.size(); ++i) {
      known_[key_of(unknown[i])] = found[i];
    }
    std::vector<double> squares;
    for (const Plan& plan : plans) {
      squares.push_back(known_.at(key_of(slews_of(plan))));
    }
    done_ += plans.size();
    if (progress_) {
      const double all = kRounds * limits_.slews * (limits_.slews + 1) / 2.0 * (14 + 7 + 10);
      progress_({}, std::min(static_cast<double>(done_) / all, 1.0));
    }
    return squares;
  }

  using Key = std::vector<std::array<double, 4>>;
  [[nodiscard]] static Key key_of(const std::vector<Slew>& slews) {
    Key key;
    for (const Slew& slew : slews) {
      key.push_back({slew.begin_s, slew.roll_rad, slew.pitch_rad, slew.yaw_rad});
    }
    return key;
  }

  DesignFlight flight_;
  std::map<Key, double> known_;  ///< by the slews
  const Eigen::MatrixXd& metric_;
  const AttitudeScenario& attitude_;
  double duration_s_;
  const SlewLimits& limits_;
  const Progress& progress_;
  std::size_t done_ = 0;
};

void check(const Scenario& scenario, const SlewLimits& limits) {
  const auto* slews = std::get_if<std::vector<Slew>>(&scenario.attitude.slews);
  if (slews == nullptr || !slews->empty()) {
    throw SetupError("the scenario has slews of its own",
                     "set slews = \"none\" in [attitude]: advice begins with that");
  }
  if (!(limits.max_angle_rad > 0 && limits.max_rate_rad_s.value_or(1) > 0 && limits.slews > 0 &&
        limits.manoeuvre_time > Duration::zero())) {
    throw SetupError("a limit of the slews is not positive", "give positive rate, angle, number and time");
  }
  if (2 * limits.manoeuvre_time > scenario.duration) {
    throw SetupError("there is no room for the slews", "give less than half of the flight to them");
  }
}

}  // namespace

std::vector<ground::Combination> Advice::formerly_weak() const {
  std::vector<ground::Combination> harmful;
  std::ranges::copy_if(before.weak, std::back_inserter(harmful),
                       [](const ground::Combination& combination) { return combination.is_harmful; });
  return harmful.empty() ? before.weak : harmful;
}

std::vector<Advice::Gain> Advice::gains() const {
  std::vector<Gain> all;
  for (const ground::Combination& combination : formerly_weak()) {
    all.push_back({combination, sigma_along(combination, before, before.covariance),
                   sigma_along(combination, before, after.covariance)});
  }
  return all;
}

Advice advise(const Scenario& scenario, const CalibrationOptions& options, const SlewLimits& limits,
              const ground::Mission& mission, const Progress& progress) {
  check(scenario, limits);
  Advice advice{scenario, {}, {}, {}};
  AttitudeScenario& attitude = advice.scenario.attitude;
  attitude.max_slew_rate_rad_s = limits.max_rate_rad_s.value_or(attitude.max_slew_rate_rad_s);
  advice.time_of_largest_slew =
      from_seconds(std::ceil(kRounding_s + 2 * sim::turn_duration_s(limits.max_angle_rad, attitude.max_slew_rate_rad_s,
                                                                    attitude.max_slew_acceleration_rad_s2)));
  advice.before = ground::observe(sim::simulate(scenario).pass, options, mission);
  attitude.slews = Search(advice.scenario, advice.before, limits, progress).best();
  if (advice.slews().empty()) {
    advice.after = advice.before;
    return advice;
  }
  advice.after = ground::observe(sim::simulate(advice.scenario).pass, advice.before.options, mission);
  return advice;
}

}  // namespace trihedron::plan
