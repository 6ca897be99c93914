#include "choose/error_shapes.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int kOfFields = ErrorColumns::kFields.size();

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Those of one gyro.
void put_errors_of_gyro(int gyro, double phase_rad, const DriftModel& fields, const PassProblem::Moment& moment,
                        const Eigen::Matrix<double, Eigen::Dynamic, 3>& by_alignment, MatrixXd& shapes) {
  const Matrix3d& C_c_b = moment.gyros[gyro].C_c_b;
  const Vector3d& h_b = moment.fix->h_b[gyro];
  constexpr int kOfReadout = ErrorColumns::kOfReadout;
  Eigen::Matrix<double, 3, kOfReadout> read;   // what a reading is off by
  read << h_b.x(), 0, 0, h_b.y(), 0, h_b.z(),  //
      0, h_b.y(), 0, h_b.x(), h_b.z(), 0,      //
      0, 0, h_b.z(), 0, h_b.y(), h_b.x();
  const Matrix3d turned_by_reading = cross(-(C_c_b * h_b)) * C_c_b;
  const Eigen::Matrix<double, 3, kOfReadout> by_readout = turned_by_reading * read;
  Columns<kOfFields> members;
  fields.basis(h_b, {}, members.view(kOfFields));
  const Eigen::Matrix<double, 3, kOfFields> by_fields = turned_by_reading * members.first(kOfFields);
  shapes.middleCols<kOfReadout>(ErrorColumns::readout(gyro)) = by_alignment.lazyProduct(by_readout);
  shapes.middleCols<3>(ErrorColumns::case_of(gyro)) = std::sin(phase_rad) * by_alignment;
  shapes.middleCols<3>(ErrorColumns::case_of(gyro) + 3) = std::cos(phase_rad) * by_alignment;
  shapes.middleCols<kOfFields>(ErrorColumns::fields(gyro)) = by_alignment.lazyProduct(by_fields);
}

}  // namespace

MatrixXd shapes_of_errors(const CalibrationSetup& setup, const DriftModel& fields, const PassProblem::Moment& moment,
                          const Layout& layout, const MatrixXd& rows, Index more) {
  MatrixXd shapes = MatrixXd::Zero(rows.rows(), ErrorColumns{layout.gyros}.size() + more);
  const double phase_rad = setup.orbital_rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
  if (moment.fix->fix.head == 0) {
    add_aberration(moment, phase_rad, rows, layout,
                   shapes.middleCols<ErrorColumns::kOfAberration>(ErrorColumns::kAberration));
    for (int i = 0; i < ErrorColumns::kMultiplesOfRate; ++i) {
      add_error_at((i + 2) * phase_rad, rows, layout, shapes.middleCols<kOfSineAndCosine>(ErrorColumns::multiple(i)));
    }
  }
  for (int k = 0; k < layout.gyros; ++k) {
    put_errors_of_gyro(k, phase_rad, fields, moment, rows.middleCols<3>(layout.alignment(k)), shapes);
  }
  return shapes;
}

void add_aberration(const PassProblem::Moment& moment, double phase_rad, const MatrixXd& rows, const Layout& layout,
                    Eigen::Ref<MatrixXd> shapes) {
  const Matrix3d aberrated =
      cross(Vector3d::UnitZ()) * moment.fix->fix.q_in_c.normalized().toRotationMatrix().transpose();
  for (int k = 0; k < layout.gyros; ++k) {
    const Eigen::Matrix<double, Eigen::Dynamic, 3> by_velocity =
        rows.middleCols<3>(layout.alignment(k)).lazyProduct(aberrated);
    shapes.middleCols<3>(0) += by_velocity;
    shapes.middleCols<3>(3) += std::cos(phase_rad) * by_velocity;
    shapes.middleCols<3>(6) += std::sin(phase_rad) * by_velocity;
  }
}

VectorXd sigmas_of_aberration() {
  constexpr double kAnnual = 6e-5;
  constexpr double kOrbital = 1.5e-5;
  VectorXd sigmas = VectorXd::Constant(ErrorColumns::kOfAberration, kOrbital);
  sigmas.head<3>().setConstant(kAnnual);
  return sigmas;
}

void add_error_at(double angle_rad, const MatrixXd& rows, const Layout& layout, Eigen::Ref<MatrixXd> error) {
  for (int k = 0; k < layout.gyros; ++k) {
    const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
    error.leftCols<3>() += std::sin(angle_rad) * by_alignment;
    error.rightCols<3>() += std::cos(angle_rad) * by_alignment;
  }
}

VectorXd rms_of_fields() {
  const DriftModel model(ErrorColumns::kFields, {});
  VectorXd rms(kOfFields);
  for (int i = 0; i < kOfFields; ++i) {
    const DriftCoefficient& member = model.member(i);
    constexpr double kOfEq1 = 0.23;  // of k0 0.195, of the others 0.239
    const bool is_rotation = member.member == DriftCoefficient::Member::kD && member.degree == 1;
    rms(i) = is_rotation          ? std::numeric_limits<double>::infinity()
             : member.is_in_eq1() ? kOfEq1
                                  : std::sqrt(member.degree * (member.degree + 1) / (4 * std::numbers::pi));
  }
  return rms;
}

}  // namespace trihedron::ground
