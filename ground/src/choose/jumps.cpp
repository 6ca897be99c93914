#include "choose/jumps.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// What fixes tell of a rotation against the star tracker: information, and its product with the rotation.
struct Told {
  Matrix3d squares = Matrix3d::Zero();
  Vector3d y = Vector3d::Zero();

  Told operator-(const Told& other) const { return {squares - other.squares, y - other.y}; }
};

constexpr std::size_t kCases = 1 + PerGyro<int>::capacity();

/// Sums over all fixes up to one: of the rotation of all cases together, then of each alone.
struct Sums {
  Time t{};
  std::array<Told, kCases> told;
};

std::vector<Sums> sums_over(const Trial& trial) {
  const PassProblem& problem = trial.problem();
  const PassSolution& solution = trial.found().solution;
  std::vector<Sums> sums(1);
  problem.go_along_momenta(solution, [&](const PassProblem::Moment& moment) {
    const MatrixXd rows = moment.fix != nullptr ? problem.rows_about_alignments(solution, moment) : MatrixXd();
    if (rows.rows() == 0) {
      return;
    }
    Sums& next = sums.emplace_back(sums.back());
    next.t = moment.t;
    const auto add = [&](const Eigen::Matrix<double, Eigen::Dynamic, 3>& by, Told& to) {
      to.squares += by.transpose() * by;
      to.y += by.transpose() * rows.rightCols<1>();
    };
    Eigen::Matrix<double, Eigen::Dynamic, 3> by_all = rows.leftCols<3>();
    for (int k = 0; k < problem.layout().gyros; ++k) {
      add(rows.middleCols<3>(3L * k), next.told[1 + static_cast<std::size_t>(k)]);
      if (k > 0) {
        by_all += rows.middleCols<3>(3L * k);
      }
    }
    add(by_all, next.told[0]);
  });
  return sums;
}

/// How far two sums of fixes are apart, squared, in sigmas. `drift_variance`: of the rotation between them.
double apart(const Told& before, const Told& after, double drift_variance) {
  constexpr double kMost_rad = 60 * kArcsecond;  // about an axis of which they tell nothing
  const auto covariance = [](const Told& told) {
    return Matrix3d((told.squares + Matrix3d::Identity() / (kMost_rad * kMost_rad)).inverse());
  };
  const Matrix3d of_before = covariance(before);
  const Matrix3d of_after = covariance(after);
  const Vector3d step = of_after * after.y - of_before * before.y;
  return step.dot((of_before + of_after + drift_variance * Matrix3d::Identity()).llt().solve(step));
}

}  // namespace

Jumps jumps_over(const Trial& trial) {
  constexpr double kWindow_s = 60;
  constexpr double kLongest_s = 300;  // where fixes are rare
  constexpr std::size_t kFewest = 10;
  constexpr double kMostOfChance = 6.25;  // of ten places nine have less
  constexpr double kLeast = 30;
  constexpr std::size_t kMost = 2;
  const std::vector<Sums> sums = sums_over(trial);
  const ProcessNoise noise = trial.problem().setup().noise();
  const bool wanders = trial.problem().layout().further.wandering_drift;
  const auto seconds = [&](std::size_t from, std::size_t to) { return to_seconds(sums[to].t - sums[from].t); };

  struct Place {
    std::size_t after = 0;
    std::array<double, kCases> squares{};
    double most = 0;
  };
  std::vector<Place> places;
  std::size_t first = 1;  // of those before; the sums at 0 are of none
  std::size_t last = 1;   // of those after
  for (std::size_t i = 1 + kFewest; i + kFewest <= sums.size(); ++i) {
    while (seconds(first, i) > kWindow_s && first + kFewest < i) {
      ++first;
    }
    while (last + 1 < sums.size() && (seconds(i, last + 1) < kWindow_s || last + 1 < i + kFewest)) {
      ++last;
    }
    if (seconds(first, last) > 2 * kLongest_s) {
      continue;
    }
    const double half_s = seconds(first, last) / 2;
    const double walk = noise.direction_random_walk_rad_sqrt_s;
    const double drift = wanders ? noise.wandering_drift.sigma * half_s : 0;
    Place place{i, {}, 0};
    for (std::size_t its = 0; its < kCases; ++its) {
      place.squares[its] = apart(sums[i - 1].told[its] - sums[first - 1].told[its],
                                 sums[last].told[its] - sums[i - 1].told[its], walk * walk * half_s + drift * drift);
    }
    places.push_back(place);
  }
  if (places.empty()) {
    return {};
  }
  // Errors that follow each other alike make all of them larger.
  for (std::size_t its = 0; its < kCases; ++its) {
    std::vector<double> squares;
    for (const Place& place : places) {
      squares.push_back(place.squares[its]);
    }
    const auto ninth = squares.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(squares.size()));
    std::ranges::nth_element(squares, ninth);
    for (Place& place : places) {
      place.most = std::max(place.most, place.squares[its] / std::max(1.0, *ninth / kMostOfChance));
    }
  }
  std::ranges::sort(places, [](const Place& a, const Place& b) { return a.most > b.most; });
  Jumps found{{}, places.size()};
  for (const Place& place : places) {
    if (place.most < kLeast || found.jumps.size() == kMost) {
      break;
    }
    const Jump jump{sums[place.after - 1].t, sums[place.after].t};
    const bool is_new = std::ranges::none_of(found.jumps, [&](const Jump& other) {
      return std::abs(to_seconds(jump.after - other.after)) < 2 * kLongest_s;
    });
    if (is_new) {
      found.jumps.push_back(jump);
    }
  }
  return found;
}

}  // namespace trihedron::ground
