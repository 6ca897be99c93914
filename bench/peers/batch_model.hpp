#pragma once
/// The whole pass as one problem of least squares, as somebody states it who has Ceres and no trihedron: the momenta
/// are carried along steps of a second by eq. (1), turned into `in` by the attitude that they and the readings give;
/// each fix is compared with them across each momentum, whitened by its correlated noise. For numbers and for Ceres'
/// Jet. trihedron's own code is not used, so that equal results say something.

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>

#include "paper_model.hpp"

namespace peers {

template <class T>
using Vec3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Mat3 = Eigen::Matrix<T, 3, 3>;

/// A time of the pass, and the fix there, or null.
struct Node {
  double t_s;
  Vector3d h_b[2];
  std::size_t sample;
  const Fix* fix;
};
/// From a node to the next; what does not depend on the estimates.
struct Step {
  Vector3d middle_b[2];                       ///< readings, their mean over it
  Eigen::Matrix<double, 3, 7> dt_basis_b[2];  ///< B of eq. (1) there, times its length
};
/// Nodes from `begin`; `end` is the first of the next arc, or the last of the pass.
struct Arc {
  std::size_t begin;
  std::size_t end;
  int fixes;
};
struct Course {
  std::vector<Node> nodes;
  std::vector<Step> steps;
  std::vector<Arc> arcs;
};

/// A node for each fix, and for samples a second apart between them.
inline Course course_of(const Pass& pass, double arc_s) {
  constexpr double kStamp_s = 1e-6;
  Course course;
  std::vector<Node>& nodes = course.nodes;
  auto fix = pass.fixes.begin();
  for (std::size_t i = 0; i < pass.samples.size(); ++i) {
    const Sample& sample = pass.samples[i];
    const Fix* here = fix != pass.fixes.end() && fix->t_s <= sample.t_s ? &*fix++ : nullptr;
    const bool fix_follows = fix != pass.fixes.end() && fix->t_s - sample.t_s < 0.5;
    const bool far = !nodes.empty() && sample.t_s - nodes.back().t_s > 1 - kStamp_s && !fix_follows;
    if (here != nullptr || far) {
      nodes.push_back({sample.t_s, {sample.h_b[0], sample.h_b[1]}, i, here});
    }
  }
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    Step& step = course.steps.emplace_back();
    const Sample& middle = pass.samples[(nodes[i].sample + nodes[i + 1].sample) / 2];
    for (int k = 0; k < 2; ++k) {  // Simpson's rule
      step.middle_b[k] = (nodes[i].h_b[k] + 4 * middle.h_b[k] + nodes[i + 1].h_b[k]).normalized();
      step.dt_basis_b[k] = (nodes[i + 1].t_s - nodes[i].t_s) * drift_basis(step.middle_b[k]);
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (course.arcs.empty() || nodes[i].t_s - nodes[course.arcs.back().begin].t_s > arc_s - kStamp_s) {
      course.arcs.push_back({i, i, 0});
    }
    course.arcs.back().end = std::min(i + 1, nodes.size() - 1);
    course.arcs.back().fixes += nodes[i].fix != nullptr ? 1 : 0;
  }
  return course;
}

inline double value_of(double x) { return x; }
template <int N>
double value_of(const ceres::Jet<double, N>& x) {
  return x.a;
}
template <class T, int Columns>
Eigen::Matrix<double, 3, Columns> values_of(const Eigen::Matrix<T, 3, Columns>& m) {
  return m.unaryExpr([](const T& x) { return value_of(x); });
}

/// Of two directions known in both frames, with equal weight.
template <class T>
Mat3<T> attitude(const Vec3<T> h_in[2], const Vec3<T> h_c[2]) {
  const auto axes = [](const Vec3<T>& a, const Vec3<T>& b) {
    Mat3<T> q;
    q.col(0) = a.cross(b).normalized();
    q.col(1) = (a + b).normalized();
    q.col(2) = q.col(0).cross(q.col(1));
    return q;
  };
  return axes(h_in[0], h_in[1]) * axes(h_c[0], h_c[1]).transpose();
}

/// exp([v×]) h, of small v.
template <class T>
Vec3<T> turned_by(const Vec3<T>& v, const Vec3<T>& h) {
  const T square = v.squaredNorm();
  const Vec3<T> across = v.cross(h);
  return h + (1.0 - square / 6.0) * across + (0.5 - square / 24.0) * v.cross(across);
}

/// exp([v×]) of an alignment v.
template <class T>
Mat3<T> rotation(const T* v) {
  Mat3<T> C;
  ceres::AngleAxisToRotationMatrix(v, C.data());
  return C;
}
/// J of d exp([v×]) = [J dv ×] exp([v×]).
inline Matrix3d left_jacobian(const Vector3d& v) {
  const double angle = v.norm();
  if (angle < 1e-9) {
    return Matrix3d::Identity() + 0.5 * cross(v);
  }
  const Vector3d axis = v / angle;
  const double part = std::sin(angle) / angle;
  return part * Matrix3d::Identity() + (1 - part) * axis * axis.transpose() +
         ((1 - std::cos(angle)) / angle) * cross(axis);
}

template <class T>
struct Estimates {
  Vec3<T> h_in[2];
  Eigen::Matrix<T, 7, 1> kappa[2];
  Mat3<T> C_c_b[2];
};

/// What a step has turned.
template <class T>
struct Turned {
  Mat3<T> C_in_c;     ///< in its middle
  Vec3<T> by_rad[2];  ///< each momentum, in
};

/// Carries both momenta over a step, by the attitude that those of its middle give.
template <class T>
Turned<T> carry(const Step& step, Estimates<T>& now) {
  Turned<T> turned;
  Vec3<T> seen_c[2];
  Vec3<T> by_c[2];
  Vec3<T> middle_in[2];
  for (int k = 0; k < 2; ++k) {
    seen_c[k] = now.C_c_b[k] * step.middle_b[k];
    by_c[k] = now.C_c_b[k] * (step.dt_basis_b[k] * now.kappa[k]);
  }
  turned.C_in_c = attitude(now.h_in, seen_c);
  for (int k = 0; k < 2; ++k) {
    middle_in[k] = turned_by(Vec3<T>(0.5 * (turned.C_in_c * by_c[k])), now.h_in[k]);
  }
  turned.C_in_c = attitude(middle_in, seen_c);
  for (int k = 0; k < 2; ++k) {
    turned.by_rad[k] = turned.C_in_c * by_c[k];
    now.h_in[k] = turned_by(turned.by_rad[k], now.h_in[k]).normalized();
  }
  return turned;
}

/// Rows: two unit vectors across h.
inline Eigen::Matrix<double, 2, 3> across(const Vector3d& h) {
  const Vector3d first = h.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> rows;
  rows << first.transpose(), h.cross(first).transpose();
  return rows;
}

/// h × h_et of both momenta: their small rotation to where the fix shows them.
template <class T>
Eigen::Matrix<T, 6, 1> misfit(const Node& node, const Estimates<T>& now) {
  const Matrix3d C_fix = node.fix->q_in_c.toRotationMatrix();
  Eigen::Matrix<T, 6, 1> y;
  for (int k = 0; k < 2; ++k) {
    const Vec3<T> h_et = C_fix * (now.C_c_b[k] * node.h_b[k]);
    y.template segment<3>(3 * k) = now.h_in[k].cross(h_et);
  }
  return y;
}

/// What makes the misfit four numbers of unit noise: at the present estimates, and constant there.
struct Whitening {
  Eigen::Matrix<double, 4, 6> rows;
  Matrix3d C_in_c;  ///< by the momenta, without the noise of the fix
};
template <class T>
Whitening whitening(const Node& node, const Estimates<T>& now) {
  Whitening its;
  const Vector3d h_in[2] = {values_of(now.h_in[0]), values_of(now.h_in[1])};
  const Vector3d h_c[2] = {values_of(now.C_c_b[0]) * node.h_b[0], values_of(now.C_c_b[1]) * node.h_b[1]};
  its.C_in_c = attitude(h_in, h_c);
  its.rows.setZero();
  Eigen::Matrix<double, 4, 3> by_fix;
  for (int k = 0; k < 2; ++k) {
    its.rows.block<2, 3>(2 * k, 3 * k) = across(h_in[k]);
    by_fix.middleRows<2>(2 * k) = its.rows.block<2, 3>(2 * k, 3 * k) * its.C_in_c * kTracker_rad.asDiagonal();
  }
  Eigen::Matrix4d R = by_fix * by_fix.transpose();
  R.diagonal().array() += kReadout_rad * kReadout_rad;
  R.llt().matrixL().solveInPlace(its.rows);
  return its;
}

}  // namespace peers
