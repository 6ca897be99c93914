#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace trihedron::ground {

/// A pass or setting that cannot work: unknown estimator, prior not positive definite, too few gyros, no usable fix.
class SetupError : public std::runtime_error {
 public:
  SetupError(const std::string& reason, std::string cure) : std::runtime_error(reason), cure_(std::move(cure)) {}
  [[nodiscard]] const std::string& cure() const { return cure_; }

 private:
  std::string cure_;
};

}  // namespace trihedron::ground
