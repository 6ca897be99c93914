#include "trihedron/core/cholesky.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace trihedron {

bool factorize(Eigen::Ref<Eigen::MatrixXd> a) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(a);
  a.triangularView<Eigen::StrictlyUpper>().setZero();
  return factor.info() == Eigen::Success;
}

void solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  b = L.triangularView<Eigen::Lower>().solve(b);
}

void solve_factorized(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  b = L.triangularView<Eigen::Lower>().solve(b);
  b = L.transpose().triangularView<Eigen::Upper>().solve(b);
}

void solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& L, RowsView b) {
  for (int i = 0; i < b.rows; ++i) {
    double* __restrict row = b.row(i);
    for (int j = 0; j < i; ++j) {
      const double by = L(i, j);
      const double* __restrict above = b.row(j);
      for (int k = 0; k < b.columns; ++k) {
        row[k] -= by * above[k];
      }
    }
    const double by = 1 / L(i, i);
    for (int k = 0; k < b.columns; ++k) {
      row[k] *= by;
    }
  }
}

bool information_root(const Eigen::Ref<const Eigen::MatrixXd>& covariance, RowsView root) {
  // Scaled to unit diagonal first: the states differ by 1e6 in size. Then covariance = U Uᵀ, from the last row up, …
  const int n = root.rows;
  if (covariance.rows() != n || covariance.cols() != n) {
    return false;
  }
  for (int i = 0; i < n; ++i) {
    if (!(covariance(i, i) > 0) || !std::isfinite(covariance(i, i))) {
      return false;
    }
  }
  for (int j = n - 1; j >= 0; --j) {
    const double sigma = std::sqrt(covariance(j, j));
    for (int i = j; i >= 0; --i) {
      double sum = covariance(j, i) / (sigma * std::sqrt(covariance(i, i)));
      for (int k = j + 1; k < n; ++k) {
        sum -= root(i, k) * root(j, k);
      }
      if (i == j) {
        constexpr double kLeast = 1e-24;
        if (!(sum > kLeast)) {
          return false;
        }
        root(j, j) = std::sqrt(sum);
      } else {
        root(i, j) = sum / root(j, j);
      }
    }
  }
  // … and the root is its inverse, column by column from the right, upwards.
  for (int j = n - 1; j >= 0; --j) {
    root(j, j) = 1 / root(j, j);
    for (int i = j - 1; i >= 0; --i) {
      double sum = 0;
      for (int k = i + 1; k <= j; ++k) {
        sum += root(i, k) * root(k, j);
      }
      root(i, j) = -sum / root(i, i);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) {
      root(i, j) /= std::sqrt(covariance(j, j));
    }
  }
  return true;
}

}  // namespace trihedron
