#pragma once

#include <algorithm>

namespace trihedron {

/// Whether residuals are of the size that their own covariance gives them, by their mean over the last hundred or so.
class Residuals {
 public:
  /// Fewer of them say nothing.
  static constexpr int kLeast = 60;
  /// Of squares over their expectation. The mean of a hundred with four components has a sigma of 0.05: neither bound
  /// is passed by chance, and between them nothing is decided anew.
  static constexpr double kAgree = 1.5;
  static constexpr double kDisagree = 2;
  static constexpr int kMemory = 100;

  /// `ratio`: a normalised square over its degrees of freedom.
  void add(double ratio) {
    count_ = std::min(count_ + 1, kMemory);
    mean_ += (ratio - mean_) / count_;
  }
  void restart() { *this = {}; }

  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] bool agree() const { return count_ >= kLeast && mean_ <= kAgree; }
  [[nodiscard]] bool disagree() const { return count_ >= kLeast && !(mean_ <= kDisagree); }

 private:
  double mean_ = 0;
  int count_ = 0;
};

}  // namespace trihedron
