#include "batch/left_out_walk.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "trihedron/core/columns.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Between the directions that are taken: members of degree 8 change in minutes.
constexpr Duration kBetweenDirections = std::chrono::minutes(1);
/// Over a longer gap nothing is added.
constexpr Duration kLongestUnread = std::chrono::minutes(5);

/// For which a random walk stands; what comes back within a shorter time stays below the noise of a fix.
constexpr std::array<Duration, 5> kLags = {std::chrono::minutes(10), std::chrono::minutes(22), std::chrono::minutes(45),
                                           std::chrono::minutes(90), std::chrono::minutes(270)};

/// Mean square, per axis across the momentum, of the change over a time, for each second of it, rad²/s; 0 of a pass
/// that is shorter.
double variance_rate(const std::vector<Time>& t, const std::vector<MatrixXd>& turned, Duration lag) {
  double square = 0;
  double seconds = 0;
  for (std::size_t i = 0, j = 0; i < t.size(); ++i) {
    while (j < t.size() && t[j] - t[i] < lag) {
      ++j;
    }
    if (j == t.size()) {
      break;
    }
    square += (turned[j] - turned[i]).squaredNorm() / 2;
    seconds += to_seconds(t[j] - t[i]);
  }
  return seconds > 0 ? square / seconds : 0;
}

}  // namespace

double left_out_walk_rad_sqrt_s(const LeftOut& left_out, const Calibration& all, const ScreenedPass& pass) {
  if (left_out.nothing()) {
    return 0;
  }
  // What is left of independent draws of the members, as coefficients of all states. In units of their sizes, which
  // differ by many powers of ten; rounding may have made the matrix indefinite.
  const MatrixXd squares = left_out.mean_squares();
  const Eigen::VectorXd size = squares.diagonal().cwiseSqrt().cwiseMax(std::numeric_limits<double>::min());
  MatrixXd scaled = size.cwiseInverse().asDiagonal() * squares * size.cwiseInverse().asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const MatrixXd root = size.asDiagonal() * MatrixXd(scaled.llt().matrixL());
  MatrixXd rest = MatrixXd::Zero(std::ssize(all.states), root.cols());
  rest(left_out.kept(), Eigen::all) = -left_out.made_up() * root;
  rest(left_out.left_out(), Eigen::all) = root;

  const DriftModel drift(all.gyros.front().drift_model, {});
  const int columns = drift.columns();
  Columns<DriftModel::kMaxMembers> basis;
  double most = 0;
  for (std::size_t k = 0; k < all.gyros.size(); ++k) {
    const Eigen::Matrix3d C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(all.gyros[k].alignment_rotation_vector_rad)).raw();
    const Index first = rows_of(all, {ParameterId::drift(k, drift.member(0))}).front();
    const MatrixXd alignment = rest.middleRows<3>(rows_of(all, {ParameterId::alignment(k, 0)}).front());
    std::vector<Time> t;
    MatrixXd turn = MatrixXd::Zero(3, rest.cols());  // by the drift, 3 × members
    MatrixXd rate_before;
    std::vector<MatrixXd> turned;  // the same, less what the alignment makes up for; `rest` has −M
    const auto gyro = static_cast<int>(k);
    for (const ScreenedPass::Fix& fix : pass.fixes) {
      if (fix.fix.head != 0 || !fix.used[gyro] || (!t.empty() && fix.fix.t - t.back() < kBetweenDirections)) {
        continue;
      }
      drift.basis(fix.h_b[gyro], {}, basis.view(columns));
      const Eigen::Matrix3d C_in_b = fix.fix.q_in_c.normalized().toRotationMatrix() * C_c_b;
      const Eigen::Matrix3d across = C_in_b - C_in_b * fix.h_b[gyro] * fix.h_b[gyro].transpose();
      MatrixXd rate = across * (basis.first(columns) * rest.middleRows(first, columns));
      if (!t.empty() && fix.fix.t - t.back() < kLongestUnread) {
        turn += to_seconds(fix.fix.t - t.back()) / 2 * (rate_before + rate);
      }
      t.push_back(fix.fix.t);
      turned.emplace_back(turn - across * C_c_b.transpose() * alignment);
      rate_before = std::move(rate);
    }
    for (const Duration lag : kLags) {
      most = std::max(most, variance_rate(t, turned, lag));
    }
  }
  return std::sqrt(most);
}

}  // namespace trihedron::ground
