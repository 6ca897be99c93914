#pragma once
/// Modes of the drift field: the combinations of coefficients outside eq. (1) that a pass can show
/// (docs/mathematics.md, section 12).

#include <Eigen/Core>
#include <vector>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::ground {

/// Of each gyro as many; what is orthogonal to them moves no momentum by as much as its noise.
struct DriftModes {
  struct OfGyro {
    Eigen::MatrixXd coefficients;  ///< by their amplitudes: a column for each mode
    Eigen::MatrixXd amplitudes;    ///< by coefficients: a row for each mode; amplitudes · coefficients = 1
  };
  PerGyro<OfGyro> gyros;
  [[nodiscard]] int size() const { return static_cast<int>(gyros[0].coefficients.cols()); }
};

/// κ and δ of all gyros in the layout `to` by those in the layout `from`: coefficients of eq. (1) and alignments are
/// the same, and `outside` makes the coefficients outside eq. (1) of each gyro, or the amplitudes of its modes.
[[nodiscard]] Eigen::MatrixXd parameters_by_parameters(const Layout& to, const Layout& from,
                                                       const PerGyro<Eigen::MatrixXd>& outside);

/// How far each mode, or each coefficient, has turned the momenta since the beginning of an arc, tabulated along a
/// pass. It depends on the estimates so little that it need not be computed again when these are corrected.
class MovedByModes {
 public:
  using Columns = PerGyro<Eigen::MatrixXf>;  ///< 3 × modes, `in`, s; to seven digits, to take half the memory

  MovedByModes() = default;
  /// Of a pass of so many arcs.
  explicit MovedByModes(std::size_t arcs) : arcs_(arcs) {}

  /// Adds a later moment of an arc; the first is its beginning, where all is zero. Different threads may add to
  /// different arcs.
  void add(std::size_t arc, Time t, Columns moved);
  /// φ of a momentum by the amplitudes of its modes, 3 × modes, at a moment of an arc: linear between those added.
  [[nodiscard]] Eigen::MatrixXd at(std::size_t arc, Time t, int gyro) const;

  /// A moment of an arc among those added: the last one before it, and how far it is to the next.
  struct Place {
    std::size_t before = 0;
    double part = 0;
  };
  [[nodiscard]] Place place(std::size_t arc, Time t) const;
  /// How many were added.
  [[nodiscard]] std::size_t size(std::size_t arc) const { return arcs_[arc].size(); }
  [[nodiscard]] Time t(std::size_t arc, std::size_t number) const { return arcs_[arc][number].t; }
  [[nodiscard]] const Eigen::MatrixXf& added(std::size_t arc, std::size_t number, int gyro) const {
    return arcs_[arc][number].moved[gyro];
  }

 private:
  struct Moment {
    Time t{};
    Columns moved;
  };
  std::vector<std::vector<Moment>> arcs_;
};

}  // namespace trihedron::ground
