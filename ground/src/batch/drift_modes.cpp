#include "batch/drift_modes.hpp"

#include <algorithm>
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

void MovedByModes::add(std::size_t arc, Time t, Columns moved) { arcs_.at(arc).push_back({t, std::move(moved)}); }

MovedByModes::Place MovedByModes::place(std::size_t arc, Time t) const {
  const std::vector<Moment>& its = arcs_.at(arc);
  const auto after = std::ranges::lower_bound(its, t, {}, &Moment::t);
  if (after == its.begin()) {
    return {};
  }
  const auto before = static_cast<std::size_t>(after - its.begin()) - 1;
  if (after == its.end()) {
    return {before, 0};
  }
  return {before, to_seconds(t - its[before].t) / to_seconds(after->t - its[before].t)};
}

MatrixXd MovedByModes::at(std::size_t arc, Time t, int gyro) const {
  const auto [before, part] = place(arc, t);
  const Eigen::MatrixXf& from = added(arc, before, gyro);
  return (part > 0 ? Eigen::MatrixXf(from + static_cast<float>(part) * (added(arc, before + 1, gyro) - from)) : from)
      .cast<double>();
}

}  // namespace trihedron::ground
