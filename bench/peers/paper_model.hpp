#pragma once
/// The paper's filter as somebody writes it who has Eigen and no trihedron: 24 states (two components of each
/// momentum's error in the quasi-inertial trihedron, seven coefficients and three alignment angles of each gyro), their
/// transition over each gyro sample, eq. (3) at each fix with the correlated noise, and feedback into the model. The
/// covariance is left to the filter that uses it. trihedron's own code is not used, so that equal results say
/// something.

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace peers {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kStates = 24;
constexpr int kMeasured = 4;
using State = Eigen::Matrix<double, kStates, 1>;
using Square = Eigen::Matrix<double, kStates, kStates>;
using Innovation = Eigen::Matrix<double, kMeasured, 1>;
using Observation = Eigen::Matrix<double, kMeasured, kStates>;
using Noise = Eigen::Matrix<double, kMeasured, kMeasured>;

// What is known before the pass, and the noise; of all peers the same.
constexpr double kStep_s = 0.125;
constexpr double kReadout_rad = 9.7e-6;
inline const Vector3d kTracker_rad{1.45e-5, 1.45e-5, 9.7e-5};
constexpr double kCoefficient_rad_s = 2e-6;
constexpr double kAlignment_rad = 8.7e-3;

struct Sample {
  double t_s;
  Vector3d h_b[2];
};
struct Fix {
  double t_s;
  Eigen::Quaterniond q_in_c;
};
struct Pass {
  std::vector<Sample> samples;
  std::vector<Fix> fixes;
};

inline std::vector<std::vector<double>> read_csv(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error(path + " cannot be read");
  }
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> row;
    for (const char* at = line.c_str(); *at != 0;) {
      char* end = nullptr;
      row.push_back(std::strtod(at, &end));
      at = *end == ',' ? end + 1 : end;
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

inline Pass read_pass(const std::string& directory) {
  Pass pass;
  for (const auto& row : read_csv(directory + "/gyro.csv")) {
    pass.samples.push_back(
        {row[0], {Vector3d(row[1], row[2], row[3]).normalized(), Vector3d(row[4], row[5], row[6]).normalized()}});
  }
  for (const auto& row : read_csv(directory + "/star_tracker.csv")) {
    pass.fixes.push_back({row[0], Eigen::Quaterniond(row[4], row[1], row[2], row[3]).normalized()});
  }
  return pass;
}

inline Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}
inline Matrix3d turn(const Vector3d& v) {
  const double angle = v.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix() : Matrix3d(Matrix3d::Identity());
}

/// Columns q1 q2 q3: q2 = h1, q1 = h1 × h2 / |h1 × h2|.
inline Matrix3d trihedron(const Vector3d& h1, const Vector3d& h2) {
  Matrix3d q;
  q.col(1) = h1.normalized();
  q.col(0) = h1.cross(h2).normalized();
  q.col(2) = q.col(0).cross(q.col(1));
  return q;
}

/// B of eq. (1).
inline Eigen::Matrix<double, 3, 7> drift_basis(const Vector3d& h) {
  const Vector3d s = h.cwiseProduct(h);
  const double sum = s.squaredNorm();
  Eigen::Matrix<double, 3, 7> B;
  B << h(0) * (sum - s(0)), h(0) * s(1), 0, -h(0) * s(2), 0, h(1) * h(2), 0,  //
      h(1) * (sum - s(1)), -h(1) * s(0), h(1) * s(2), 0, 0, 0, h(2) * h(0),   //
      h(2) * (sum - s(2)), 0, -h(2) * s(1), h(2) * s(0), h(0) * h(1), 0, 0;
  return B;
}

struct Gyro {
  Vector3d h_in = Vector3d::UnitX();
  Eigen::Matrix<double, 7, 1> kappa = Eigen::Matrix<double, 7, 1>::Zero();
  Matrix3d C_c_b = Matrix3d::Identity();
};

/// Two components of the error of each momentum, and the momentum's error by them.
struct Basis {
  Eigen::Matrix<double, 2, 3> components[2];
  Eigen::Matrix<double, 3, 2> tangents[2];

  Basis() = default;
  explicit Basis(const Gyro* gyros) {
    const Matrix3d q = trihedron(gyros[0].h_in, gyros[1].h_in);
    const double cotangent = gyros[0].h_in.dot(gyros[1].h_in) / gyros[0].h_in.cross(gyros[1].h_in).norm();
    components[0] << q.col(0).transpose(), q.col(2).transpose();
    tangents[0] << q.col(0), q.col(2);
    components[1] << q.col(0).transpose(), q.col(1).transpose();
    tangents[1] << q.col(0), q.col(1) - cotangent * q.col(2);
  }
};

class Model {
 public:
  static constexpr int direction(int gyro) { return 2 * gyro; }
  static constexpr int drift(int gyro) { return 4 + 10 * gyro; }
  static constexpr int alignment(int gyro) { return drift(gyro) + 7; }

  const Gyro& gyro(int k) const { return gyros_[k]; }

  /// Momenta by the first fix; gives the covariance after it.
  Square start(const Fix& fix, const Sample& sample) {
    const Matrix3d C_in_c = fix.q_in_c.toRotationMatrix();
    for (int k = 0; k < 2; ++k) {
      gyros_[k].h_in = C_in_c * (gyros_[k].C_c_b * sample.h_b[k]);
    }
    basis_ = Basis(gyros_);
    Square P = Square::Zero();
    for (int k = 0; k < 2; ++k) {
      P.diagonal().segment<7>(drift(k)).setConstant(kCoefficient_rad_s * kCoefficient_rad_s);
      P.diagonal().segment<3>(alignment(k)).setConstant(kAlignment_rad * kAlignment_rad);
    }
    Innovation y;
    Observation H;
    Noise R;
    measure(fix, sample, y, H, R);
    // y = Δh + H_p p + noise is zero: Δh = −H_p p − noise.
    Observation by_parameters = H;
    by_parameters.leftCols<4>().setZero();
    P.topLeftCorner<4, 4>() = by_parameters * P * by_parameters.transpose() + R;
    const Eigen::Matrix<double, 4, kStates> mixed = -by_parameters * P;
    P.topRightCorner<4, kStates - 4>() = mixed.rightCols<kStates - 4>();
    P.bottomLeftCorner<kStates - 4, 4>() = mixed.rightCols<kStates - 4>().transpose();
    return P;
  }

  /// Over one sample, with its readings for the whole step; gives the transition of the errors.
  void step(const Sample& sample, Square& F) {
    Vector3d h_c[2];
    for (int k = 0; k < 2; ++k) {
      h_c[k] = gyros_[k].C_c_b * sample.h_b[k];
    }
    const Matrix3d C_in_c = trihedron(gyros_[0].h_in, gyros_[1].h_in) * trihedron(h_c[0], h_c[1]).transpose();
    Vector3d before[2];
    Vector3d turned[2];
    Eigen::Matrix<double, 3, 7> by_drift[2];
    for (int k = 0; k < 2; ++k) {
      by_drift[k] = kStep_s * C_in_c * gyros_[k].C_c_b * drift_basis(sample.h_b[k]);
      turned[k] = by_drift[k] * gyros_[k].kappa;
      before[k] = gyros_[k].h_in;
      gyros_[k].h_in = (turn(turned[k]) * before[k]).normalized();
    }
    const Basis now(gyros_);
    F.setIdentity();
    for (int k = 0; k < 2; ++k) {
      const Eigen::Matrix<double, 2, 3> of_turn = -now.components[k] * cross(gyros_[k].h_in);
      const int row = direction(k);
      F.block<2, 2>(row, row) =
          of_turn * (Matrix3d::Identity() + cross(turned[k])) * cross(before[k]) * basis_.tangents[k];
      F.block<2, 7>(row, drift(k)) = of_turn * by_drift[k];
      F.block<2, 3>(row, alignment(k)) = -of_turn * cross(turned[k]) * C_in_c;
    }
    basis_ = now;
  }

  /// y = H x + noise of covariance R.
  void measure(const Fix& fix, const Sample& sample, Innovation& y, Observation& H, Noise& R) const {
    const Matrix3d C_in_c = fix.q_in_c.toRotationMatrix();
    H.setZero();
    Eigen::Matrix<double, kMeasured, 9> noise = Eigen::Matrix<double, kMeasured, 9>::Zero();
    for (int k = 0; k < 2; ++k) {
      const int row = direction(k);
      const Vector3d reference = C_in_c * (gyros_[k].C_c_b * sample.h_b[k]);
      const Eigen::Matrix<double, 2, 3> across = basis_.components[k] * cross(reference);
      y.segment<2>(row) = basis_.components[k] * (reference - gyros_[k].h_in);
      H.block<2, 2>(row, row).setIdentity();
      H.block<2, 3>(row, alignment(k)) = across * C_in_c;
      noise.block<2, 3>(row, 0) = across * C_in_c * kTracker_rad.asDiagonal();
      noise.block<2, 3>(row, 3 + 3 * k) = kReadout_rad * across;
    }
    R = noise * noise.transpose();
  }

  void feed_back(const State& x) {
    for (int k = 0; k < 2; ++k) {
      Gyro& gyro = gyros_[k];
      const Vector3d error = basis_.tangents[k] * x.segment<2>(direction(k));
      gyro.h_in = (turn(gyro.h_in.cross(error)) * gyro.h_in).normalized();
      gyro.kappa += x.segment<7>(drift(k));
      gyro.C_c_b = Eigen::Quaterniond(turn(x.segment<3>(alignment(k))) * gyro.C_c_b).normalized().toRotationMatrix();
    }
  }

 private:
  Gyro gyros_[2];
  Basis basis_;
};

/// Flies a pass. `Filter` has start(P), predict(F), and update(y, H, R), which returns the correction, and
/// covariance().
template <class Filter>
Model fly(const Pass& pass, Filter& filter) {
  Model model;
  Square F;
  Innovation y;
  Observation H;
  Noise R;
  bool started = false;
  auto fix = pass.fixes.begin();
  for (const Sample& sample : pass.samples) {
    if (started) {
      model.step(sample, F);
      filter.predict(F);
    }
    if (fix != pass.fixes.end() && fix->t_s <= sample.t_s) {
      if (started) {
        model.measure(*fix, sample, y, H, R);
        model.feed_back(filter.update(y, H, R));
      } else {
        filter.start(model.start(*fix, sample));
        started = true;
      }
      ++fix;
    }
  }
  return model;
}

inline double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// One line of JSON: seconds of the processor, the 20 parameters and their 1-sigmas.
inline void print(const char* name, double seconds, const Model& model, const Square& P) {
  std::printf("{\"peer\": \"%s\", \"seconds\": %.6f, \"parameters\": [", name, seconds);
  for (int k = 0; k < 2; ++k) {
    const Eigen::AngleAxisd alignment(model.gyro(k).C_c_b);
    const Vector3d vector = alignment.angle() * alignment.axis();
    for (int i = 0; i < 7; ++i) {
      std::printf("%s%.17g", k + i > 0 ? ", " : "", model.gyro(k).kappa(i));
    }
    std::printf(", %.17g, %.17g, %.17g", vector.x(), vector.y(), vector.z());
  }
  std::printf("], \"sigmas\": [");
  for (int i = 4; i < kStates; ++i) {
    std::printf("%s%.17g", i > 4 ? ", " : "", std::sqrt(P(i, i)));
  }
  std::printf("]}\n");
}

/// The best of `times` runs.
template <class Filter>
void measure_and_print(const char* name, const Pass& pass, int times) {
  double best = 1e300;
  for (int i = 0; i < times; ++i) {
    Filter filter;
    const double begin = processor_s();
    const Model model = fly(pass, filter);
    best = std::min(best, processor_s() - begin);
    if (i + 1 == times) {
      print(name, best, model, filter.covariance());
    }
  }
}

}  // namespace peers
