#pragma once
/// Whether the innovations of the fixes are correlated in time, as those of a filter whose model holds are not.

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

namespace trihedron {

/// Evidence by sums of white innovations over blocks of fixes (docs/mathematics.md, section 11). By the model the
/// product of the sums of two blocks that follow each other, over kBlock, has the mean 0 and the variance of
/// `components`; a mean b of the innovations adds kBlock |b|². What the products exceed kTolerated by, for each
/// component, is summed up, never below zero (Page, "Continuous inspection schemes", Biometrika 41, 1954).
template <int kMaxComponents>
class InnovationCorrelation {
 public:
  static constexpr int kBlock = 20;  ///< fixes

  /// The innovation of a fix that is used, of unit variance by the model. Whether the noise is larger or smaller than
  /// the model says makes no difference: products are over the mean square that the innovations have.
  template <class Vector>
  void add(const Vector& white) {
    const auto components = static_cast<std::uint8_t>(white.size());
    if (components != components_) {  // of other gyros
      *this = {};
      components_ = components;
    }
    const auto size = static_cast<float>(components);
    remembered_ = static_cast<std::uint8_t>(std::min(remembered_ + 1, kMemory));
    mean_square_ += (static_cast<float>(white.squaredNorm()) / size - mean_square_) / static_cast<float>(remembered_);
    sum_.head(components) += white.template cast<float>();
    if (++in_block_ < kBlock) {
      return;
    }
    const float product = sum_.dot(before_) / (static_cast<float>(kBlock) * mean_square_);
    evidence_ = std::max(evidence_ + product - kTolerated * size, 0.0F);
    before_ = sum_;
    sum_.setZero();
    in_block_ = 0;
  }

  /// By chance alone once in a million blocks at most, of up to four gyros.
  [[nodiscard]] bool found() const { return evidence_ > kLimit; }

 private:
  using Sum = Eigen::Matrix<float, kMaxComponents, 1>;
  static constexpr int kMemory = 100;  ///< of the mean square, fixes
  static constexpr float kTolerated = 1;
  static constexpr float kLimit = 20;

  Sum sum_ = Sum::Zero();
  Sum before_ = Sum::Zero();
  float mean_square_ = 0;
  float evidence_ = 0;
  std::uint8_t components_ = 0;
  std::uint8_t in_block_ = 0;
  std::uint8_t remembered_ = 0;
};

}  // namespace trihedron
