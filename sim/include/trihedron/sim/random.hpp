#pragma once
/// Random streams that depend on (seed, source, index) alone, and are the same on every machine and thread count.

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

namespace trihedron::sim {

/// What a random stream is for. The numbers decide which pass a seed gives: add new ones, never renumber.
enum class Source : std::uint64_t {
  kKappa = 1,
  kMisalignment,
  kOutsideDrift,
  kCoefficientWalk,
  kDirectionWalk,
  kMarkovDrift,
  kReadoutNoise,
  kReadoutDropout,
  kReadoutSpike,
  kReadoutStuck,
  kImaging,
  kJitter,
  kTrackerNoise,
  kTrackerField,
  kTrackerDropout,
  kTrackerOutlier,
  kTrackerSign,
  kDriftBump,
  kCoefficientJump,
  kPolhode,
};

/// splitmix64 (Steele, Lea, Flood 2014): advances the state and returns its next value. Bijective in the state.
[[nodiscard]] constexpr std::uint64_t splitmix64(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

/// xoshiro256++ 1.0 (Blackman, Vigna 2019), period 2²⁵⁶ − 1, seeded by splitmix64 as its authors ask.
class Stream {
 public:
  /// The stream of one source in one sensor (gyro `index`, star-tracker head `index`, …).
  Stream(std::uint64_t seed, Source source, std::uint64_t index = 0) {
    // Each part is mixed before the next is added, so that neighbouring seeds, or equal sums of the three, give
    // different streams.
    std::uint64_t key = seed;
    key = splitmix64(key) ^ static_cast<std::uint64_t>(source);
    key = splitmix64(key) ^ index;
    for (std::uint64_t& word : state_) {
      word = splitmix64(key);
    }
  }

  [[nodiscard]] std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] bool happens(double probability) { return uniform() < probability; }

  /// A point in the unit circle, uniform over its area, and its squared distance from the centre, above 0.
  struct InCircle {
    double x = 0;
    double y = 0;
    double square = 0;
  };
  [[nodiscard]] InCircle in_circle() {
    InCircle point;
    fill({&point, 1});
    return point;
  }
  /// As many of them.
  void fill(std::span<InCircle> points) {
    for (std::size_t found = 0; found < points.size();) {
      found += try_point(points[found]);
    }
  }
  /// The same of two streams, neither of which waits for the other: in little more than the time of one.
  static void fill_both(Stream& a, std::span<InCircle> points_a, Stream& b, std::span<InCircle> points_b) {
    std::size_t found_a = 0;
    std::size_t found_b = 0;
    while (found_a < points_a.size() && found_b < points_b.size()) {
      found_a += a.try_point(points_a[found_a]);
      found_b += b.try_point(points_b[found_b]);
    }
    a.fill(points_a.subspan(found_a));
    b.fill(points_b.subspan(found_b));
  }

  /// Standard normal: Marsaglia's polar method, which gives them in pairs.
  [[nodiscard]] double normal() {
    if (spare_ready_) {
      spare_ready_ = false;
      return spare_;
    }
    const InCircle point = in_circle();
    const double factor = std::sqrt(-2 * std::log(point.square) / point.square);
    spare_ = point.y * factor;
    spare_ready_ = true;
    return point.x * factor;
  }

  /// Three independent standard normals.
  [[nodiscard]] Eigen::Vector3d normal3() {
    const double x = normal();
    const double y = normal();
    return {x, y, normal()};
  }

  /// Unit vector, uniform over the sphere (its z is uniform in −1 … 1, by Archimedes).
  [[nodiscard]] Eigen::Vector3d direction() {
    const double z = uniform(-1, 1);
    const double azimuth = uniform(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(azimuth), r * std::sin(azimuth), z};
  }

 private:
  /// 1 where the point lies in the circle, else 0. A processor cannot foresee it: a point is put where the next one
  /// belongs, and stays where it does.
  std::size_t try_point(InCircle& point) {
    point.x = uniform(-1, 1);
    point.y = uniform(-1, 1);
    point.square = point.x * point.x + point.y * point.y;
    return static_cast<std::size_t>(static_cast<int>(point.square < 1) & static_cast<int>(point.square > 0));
  }

  std::array<std::uint64_t, 4> state_{};
  double spare_ = 0;
  bool spare_ready_ = false;
};

}  // namespace trihedron::sim
