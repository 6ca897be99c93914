#include "batch/drift_modes.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace trihedron::ground {

using Eigen::MatrixXd;

MatrixXd parameters_by_parameters(const Layout& to, const Layout& from, const PerGyro<MatrixXd>& outside) {
  MatrixXd map = MatrixXd::Zero(to.parameters(), from.parameters());
  for (int k = 0; k < to.gyros; ++k) {
    const int row = to.drift(k) - to.drift(0);
    const int column = from.drift(k) - from.drift(0);
    map.block<Layout::kEq1, Layout::kEq1>(row, column).setIdentity();
    map.block(row + Layout::kEq1, column + Layout::kEq1, outside[k].rows(), outside[k].cols()) = outside[k];
    map.block<3, 3>(row + to.drift_size(), column + from.drift_size()).setIdentity();
  }
  return map;
}

void MovedByModes::add(std::size_t arc, Time t, Columns moved) {
  arcs_.resize(std::max(arcs_.size(), arc + 1));
  arcs_[arc].push_back({t, std::move(moved)});
}

MatrixXd MovedByModes::at(std::size_t arc, Time t, int gyro) const {
  const std::vector<Moment>& its = arcs_.at(arc);
  const auto after = std::ranges::lower_bound(its, t, {}, &Moment::t);
  if (after == its.begin() || after == its.end()) {
    return (after == its.end() ? its.back() : *after).moved[gyro].cast<double>();
  }
  const Moment& before = *std::prev(after);
  const auto part = static_cast<float>(to_seconds(t - before.t) / to_seconds(after->t - before.t));
  return (before.moved[gyro] + part * (after->moved[gyro] - before.moved[gyro])).cast<double>();
}

}  // namespace trihedron::ground
