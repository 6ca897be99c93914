#include "judge/shape_of_errors.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/scatter.hpp"

namespace trihedron::ground {
namespace {

constexpr Eigen::Index kFewest = 1000;

/// What the fixes are off the navigator, from each of its corrections to the next.
std::vector<Eigen::Matrix3Xd> off_navigator(const std::vector<FixRecord>& fixes, int head) {
  std::vector<std::vector<double>> found;
  int corrections = 0;
  for (const FixRecord& fix : fixes) {
    if (fix.corrected_navigator && ++corrections >= 2) {
      found.emplace_back();
    }
    if (!found.empty() && fix.head == head && fix.status == FixStatus::kUsed && fix.off_navigator_rad) {
      found.back().insert(found.back().end(), fix.off_navigator_rad->begin(), fix.off_navigator_rad->end());
    }
  }
  std::vector<Eigen::Matrix3Xd> off;
  for (const std::vector<double>& its : found) {
    off.emplace_back(Eigen::Matrix3Xd::Map(its.data(), 3, static_cast<Eigen::Index>(its.size() / 3)));
  }
  return off;
}

/// The size that nine tenths of the values of each row do not exceed.
Eigen::Array3d size_of_nine_tenths(const Eigen::Ref<const Eigen::Matrix3Xd>& values) {
  Eigen::Array3d result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::ArrayXd sizes = values.row(axis).cwiseAbs().transpose();
    std::vector<double> sorted(sizes.begin(), sizes.end());
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(sorted.size() - 1));
    std::ranges::nth_element(sorted, at);
    result(axis) = *at;
  }
  return result;
}

/// Less what moves slowly, and without single outliers, which are fewer than one fix in ten. The limit is taken from
/// the larger errors: where two star trackers of other noise give fixes by turns, the median is that of the better one,
/// and errors of the other would be outliers by it.
Eigen::Matrix3Xd from_fix_to_fix(const std::vector<Eigen::Matrix3Xd>& off) {
  constexpr Eigen::Index kWindow = ShapeOfErrors::kNeighbours;
  constexpr double kOutlier = 6;         // standard deviations
  constexpr double kNineTenths = 1.645;  // of a normal distribution, in standard deviations
  std::vector<double> found;
  for (const Eigen::Matrix3Xd& its : off) {
    for (Eigen::Index i = 0; i + kWindow <= its.cols(); ++i) {
      const Eigen::Vector3d quick = its.col(i + kWindow / 2) - its.middleCols<kWindow>(i).rowwise().mean();
      found.insert(found.end(), quick.begin(), quick.end());
    }
  }
  Eigen::Matrix3Xd quick = Eigen::Matrix3Xd::Map(found.data(), 3, static_cast<Eigen::Index>(found.size() / 3));
  if (quick.cols() == 0) {
    return quick;
  }
  const Eigen::Array3d limit = kOutlier / kNineTenths * size_of_nine_tenths(quick);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < quick.cols(); ++i) {
    if ((quick.col(i).array().abs() <= limit).all()) {
      quick.col(kept++) = quick.col(i);
    }
  }
  return quick.leftCols(kept);
}

/// Evenly over half a sphere, some 7° from each other: a golden spiral.
std::vector<Eigen::Vector3d> directions() {
  constexpr int kCount = 400;
  std::vector<Eigen::Vector3d> found;
  for (int i = 0; i < kCount; ++i) {
    const double z = (i + 0.5) / kCount;
    const double angle = i * 2 * std::numbers::pi / std::numbers::phi;
    found.emplace_back(std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z);
  }
  return found;
}

}  // namespace

std::optional<ShapeOfErrors> shape_of_errors(const std::vector<FixRecord>& fixes, int head) {
  const Eigen::Matrix3Xd errors = from_fix_to_fix(off_navigator(fixes, head));
  if (errors.cols() < kFewest) {
    return std::nullopt;
  }
  const auto count = static_cast<double>(errors.cols());
  const Eigen::Vector3d mean = errors.rowwise().mean();
  const Eigen::Matrix3Xd centred = errors.colwise() - mean;
  const Eigen::LLT<Eigen::Matrix3d> root(centred * centred.transpose() / count);
  // Errors of a star tracker that was simulated without any are all alike.
  if (root.info() != Eigen::Success) {
    return std::nullopt;
  }
  const Eigen::Matrix3Xd z = root.matrixL().solve(centred);
  ShapeOfErrors shape{.fixes = static_cast<std::size_t>(errors.cols()),
                      .mean_off_median_rad = mean - medians_of(errors)};
  for (const Eigen::Vector3d& direction : directions()) {
    const Eigen::ArrayXd along = (direction.transpose() * z).transpose();
    const Eigen::ArrayXd cube = along.cube();
    if (const double skewness = std::abs(cube.mean()); skewness > shape.skewness) {
      shape.skewness = skewness;
      shape.skewness_sigma = std::sqrt(cube.square().mean() / count);
    }
    shape.least_kurtosis = std::min(shape.least_kurtosis, (along * cube).mean() - 3);
  }
  return shape;
}

}  // namespace trihedron::ground
