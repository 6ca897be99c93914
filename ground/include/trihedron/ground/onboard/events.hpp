#pragma once
/// The telemetry of a pass as one sequence of events.

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The events of a pass as the spacecraft would have them: in time order, a fix after the gyro sample of the same time,
/// and of such fixes that of the first star tracker first.
class Events {
 public:
  using Event = std::variant<GyroSample, StarFix>;

  /// How many have been taken; plain data.
  struct Position {
    std::uint64_t samples = 0;
    std::array<std::uint64_t, kMaxStarTrackers> fixes{};  ///< of each star tracker
  };

  /// Refers to the pass. Star trackers beyond the first `star_trackers` are not used.
  Events(const Pass& pass, int star_trackers) : Events(pass, star_trackers, Position{}) {}
  /// From there on.
  Events(const Pass& pass, int star_trackers, const Position& from);

  /// Of the next event; nothing after the last one.
  [[nodiscard]] std::optional<Time> next_t() const;
  /// Takes the next event; nothing after the last one.
  [[nodiscard]] std::optional<Event> next();
  [[nodiscard]] const Position& position() const { return position_; }

 private:
  /// Of the star tracker whose fix is next among the fixes; −1: there are no more.
  [[nodiscard]] int next_head() const;
  [[nodiscard]] Time fix_t(int head) const;
  [[nodiscard]] bool has_sample() const { return position_.samples < gyro_->size(); }
  [[nodiscard]] Time sample_t() const { return gyro_->t[position_.samples]; }

  const GyroTelemetry* gyro_;
  std::vector<const StarTrackerTelemetry*> heads_;
  Position position_;
};

}  // namespace trihedron::ground
