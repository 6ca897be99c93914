#include "observe/combinations.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {
namespace {

/// Least squared share of a block in a combination for it to be named.
constexpr double kLeastShareNamed = 0.1;
/// Axes within 15° have the same name.
constexpr double kSameAxis = 0.966;

std::string axis_name(const Eigen::Vector3d& axis_c, const BodyRotation& rotation) {
  if (std::abs(axis_c.dot(rotation.axis_c)) > kSameAxis) {
    return rotation.is_orbital ? "the orbit normal" : "the axis that the body turns about";
  }
  if (std::abs(axis_c.z()) > kSameAxis) {
    return "the boresight (c z)";
  }
  return fmt::format("({:+.2f}, {:+.2f}, {:+.2f}) in c", axis_c.x(), axis_c.y(), axis_c.z());
}

}  // namespace

ParameterBlocks::ParameterBlocks(const std::vector<ParameterId>& parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterId& parameter = parameters[i];
    Block block{name_of(parameter), parameter.is_alignment(), {}, {}};
    if (parameter.is_alignment() || parameter.is_drift()) {
      block.name = fmt::format("gyro {} {}", parameter.gyro() + 1, parameter.is_alignment() ? "alignment" : "drift");
    }
    if (blocks_.empty() || blocks_.back().name != block.name) {
      blocks_.push_back(block);
    }
    blocks_.back().rows.push_back(static_cast<Eigen::Index>(i));
    if (parameter.is_drift()) {
      blocks_.back().parameters.push_back(short_name_of(parameter));
    }
  }
}

Eigen::MatrixXd ParameterBlocks::separated(Eigen::MatrixXd space) const {
  const Eigen::Index size = space.cols();
  Eigen::MatrixXd columns(space.rows(), size);
  for (Eigen::Index i = 0; i < size; ++i) {
    double most = -1;
    Eigen::VectorXd best;
    for (const Block& block : blocks_) {
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(space(block.rows, Eigen::all), Eigen::ComputeFullV);
      if (svd.singularValues()(0) > most) {
        most = svd.singularValues()(0);
        best = svd.matrixV().col(0);
      }
    }
    columns.col(i) = space * best;
    // What is left: the columns across it.
    const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(best).householderQ();
    space = (space * Q.rightCols(space.cols() - 1)).eval();
  }
  return columns;
}

std::string ParameterBlocks::in_words(const Eigen::VectorXd& direction, const Eigen::VectorXd& prior_sigma,
                                      const BodyRotation& rotation) const {
  std::string text;
  for (const Block& block : blocks_) {
    const Eigen::VectorXd own = direction(block.rows);
    if (own.squaredNorm() < kLeastShareNamed) {
      continue;
    }
    text += (text.empty() ? "" : ", with ") + block.name;
    if (block.is_alignment) {
      const Eigen::Vector3d axis_c = own.cwiseProduct(prior_sigma(block.rows)).normalized();
      text += " about " + axis_name(axis_c, rotation) + ", against its initial direction";
    } else if (!block.parameters.empty()) {
      std::vector<std::string> named;
      const double least = std::min(kLeastShareNamed, own.cwiseAbs2().maxCoeff());
      for (Eigen::Index i = 0; i < own.size(); ++i) {
        if (own(i) * own(i) >= least) {
          named.push_back(block.parameters[static_cast<std::size_t>(i)]);
        }
      }
      text += fmt::format(" {}", fmt::join(named, ", "));
    }
  }
  return text;
}

Eigen::VectorXd ParameterBlocks::named(Eigen::VectorXd direction) const {
  for (const Block& block : blocks_) {
    if (direction(block.rows).squaredNorm() < kLeastShareNamed) {
      direction(block.rows).setZero();
    }
  }
  return direction.normalized();
}

bool ParameterBlocks::is_alignment(const Eigen::VectorXd& direction) const {
  return std::ranges::all_of(blocks_, [&](const Block& block) {
    return block.is_alignment || direction(block.rows).squaredNorm() < kLeastShareNamed;
  });
}

}  // namespace trihedron::ground
