#pragma once

#include <functional>
#include <string_view>

namespace trihedron {

/// Called now and then with what is being done, empty where the work is of one kind, and the fraction done of that, 0 …
/// 1; 0 as long as it is not known.
using Progress = std::function<void(std::string_view doing, double fraction)>;

/// Tells that `doing` begins, where anybody is to be told.
inline void begin_stage(const Progress& progress, std::string_view doing) {
  if (progress) {
    progress(doing, 0);
  }
}

}  // namespace trihedron
