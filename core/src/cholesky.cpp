#include "trihedron/core/cholesky.hpp"

#include <cmath>

#include "trihedron/core/square_root_covariance.hpp"

namespace trihedron {

bool factorize(Eigen::Ref<Eigen::MatrixXd> a) {
  const Eigen::Index n = a.rows();
  bool positive = true;
  for (Eigen::Index j = 0; j < n; ++j) {
    double square = a(j, j);
    for (Eigen::Index k = 0; k < j; ++k) {
      square -= a(j, k) * a(j, k);
      a(k, j) = 0;
    }
    positive = positive && square > 0;
    a(j, j) = std::sqrt(square);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double sum = a(i, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        sum -= a(i, k) * a(j, k);
      }
      a(i, j) = sum / a(j, j);
    }
  }
  return positive;
}

void solve_lower(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> b) {
  for (Eigen::Index column = 0; column < b.cols(); ++column) {
    for (Eigen::Index i = 0; i < b.rows(); ++i) {
      double sum = b(i, column);
      for (Eigen::Index k = 0; k < i; ++k) {
        sum -= L(i, k) * b(k, column);
      }
      b(i, column) = sum / L(i, i);
    }
  }
}

void solve_factorized(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> b) {
  solve_lower(L, b);
  for (Eigen::Index column = 0; column < b.cols(); ++column) {
    for (Eigen::Index i = b.rows() - 1; i >= 0; --i) {
      double sum = b(i, column);
      for (Eigen::Index k = i + 1; k < b.rows(); ++k) {
        sum -= L(k, i) * b(k, column);
      }
      b(i, column) = sum / L(i, i);
    }
  }
}

void solve_lower(const MatrixView& L, RowsView b) {
  for (int i = 0; i < b.rows; ++i) {
    double* row = b.row(i);
    take_off(L.data() + i, L.outerStride(), {b.data, i, b.columns, b.stride}, row);
    const double by = 1 / L(i, i);
    for (int k = 0; k < b.columns; ++k) {
      row[k] *= by;
    }
  }
}

bool covariance_root(const Eigen::Ref<const Eigen::MatrixXd>& covariance, RowsView root) {
  // Scaled to unit diagonal, since the states differ by 1e6 in size; then from the last row up.
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
  for (int i = 0; i < n; ++i) {
    const double sigma = std::sqrt(covariance(i, i));
    for (int j = i; j < n; ++j) {
      root(i, j) *= sigma;
    }
  }
  return true;
}

}  // namespace trihedron
