#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace trihedron::test {

/// Central differences of f at x with the given step per component: one column per component.
template <class F, int N>
auto central_differences(F&& f, const Eigen::Matrix<double, N, 1>& x, double step) {
  using Value = decltype(f(x));
  Eigen::Matrix<double, Value::RowsAtCompileTime, N> j;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::Matrix<double, N, 1> up = x;
    Eigen::Matrix<double, N, 1> down = x;
    up(i) += step;
    down(i) -= step;
    const Value difference = f(up) - f(down);
    j.resize(difference.size(), x.size());
    j.col(i) = difference / (up(i) - down(i));
  }
  return j;
}

/// Analytic against numerical, relative to the Jacobian's own size; refuses a comparison of zeros.
template <class A, class B>
void expect_jacobian(const A& analytic, const B& numerical, double relative) {
  ASSERT_GT(analytic.norm(), 0);
  EXPECT_LT((analytic - numerical).norm(), relative * analytic.norm()) << "analytic\n"
                                                                       << analytic << "\nnumerical\n"
                                                                       << numerical;
}

}  // namespace trihedron::test
