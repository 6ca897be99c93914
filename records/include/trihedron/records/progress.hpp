#pragma once

#include <functional>

namespace trihedron {

/// Called now and then with the fraction done, 0 … 1.
using Progress = std::function<void(double)>;

}  // namespace trihedron
