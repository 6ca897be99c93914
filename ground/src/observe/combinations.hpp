#pragma once
/// Weakly determined combinations of parameters: separation into blocks and description in words.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "trihedron/records/parameter_id.hpp"

namespace trihedron::ground {

/// Mean axis about which the body turns; zero where it does not turn.
struct BodyRotation {
  Eigen::Vector3d axis_c{0, 0, 0};  ///< unit
  bool is_orbital = false;          ///< at the rate of an orbit
};

class ParameterBlocks {
 public:
  /// The drift coefficients of a gyro are a block, so are its alignments; each further state is one of its own.
  explicit ParameterBlocks(const std::vector<ParameterId>& parameters);

  /// Other orthonormal columns of the same space: the first lies as nearly within one block as any direction of the
  /// space, the second as nearly as any of the rest, and so on. `space`: one row per parameter.
  [[nodiscard]] Eigen::MatrixXd separated(Eigen::MatrixXd space) const;

  /// "gyro 1 alignment about the orbit normal, against its initial direction". `direction`: unit, by parameter, each in
  /// its prior sigma.
  [[nodiscard]] std::string in_words(const Eigen::VectorXd& direction, const Eigen::VectorXd& prior_sigma,
                                     const BodyRotation& rotation) const;

  /// The part of a direction that in_words() names, unit.
  [[nodiscard]] Eigen::VectorXd named(Eigen::VectorXd direction) const;

  /// Whether only alignments would be named.
  [[nodiscard]] bool is_alignment(const Eigen::VectorXd& direction) const;

 private:
  struct Block {
    std::string name;
    bool is_alignment = false;
    std::vector<Eigen::Index> rows;
    std::vector<std::string> parameters;  ///< of drift; else empty
  };
  std::vector<Block> blocks_;
};

}  // namespace trihedron::ground
