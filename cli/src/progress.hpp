#pragma once

#include <functional>
#include <string>

namespace trihedron::cli {

/// A progress bar on stderr: only to a terminal, gone when its owner is.
class ProgressBar {
 public:
  ProgressBar(std::string what, bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To be called with the fraction done, 0 … 1.
  [[nodiscard]] std::function<void(double)> meter() const;

 private:
  std::string what_;
  bool shown_;
};

}  // namespace trihedron::cli
