#include "trihedron/ground/onboard/events.hpp"

#include <algorithm>

namespace trihedron::ground {

Events::Events(const Pass& pass, int star_trackers, const Position& from) : gyro_(&pass.gyro), position_(from) {
  heads_.push_back(&pass.star_tracker);
  for (const StarTrackerTelemetry& further : pass.further_star_trackers) {
    heads_.push_back(&further);
  }
  heads_.resize(std::min(heads_.size(), static_cast<std::size_t>(star_trackers)));
}

Time Events::fix_t(int head) const {
  const auto i = static_cast<std::size_t>(head);
  return heads_[i]->t[position_.fixes[i]];
}

int Events::next_head() const {
  int earliest = -1;
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    const int head = static_cast<int>(i);
    if (position_.fixes[i] < heads_[i]->size() && (earliest < 0 || fix_t(head) < fix_t(earliest))) {
      earliest = head;
    }
  }
  return earliest;
}

std::optional<Time> Events::next_t() const {
  const int head = next_head();
  if (head < 0) {
    return has_sample() ? std::optional(sample_t()) : std::nullopt;
  }
  return has_sample() ? std::min(sample_t(), fix_t(head)) : fix_t(head);
}

std::optional<Events::Event> Events::next() {
  const int head = next_head();
  if (has_sample() && (head < 0 || sample_t() <= fix_t(head))) {
    return sample_of(*gyro_, position_.samples++);
  }
  if (head < 0) {
    return std::nullopt;
  }
  const auto which = static_cast<std::size_t>(head);
  const std::uint64_t i = position_.fixes[which]++;
  return heads_[which]->fix(i, head);
}

}  // namespace trihedron::ground
