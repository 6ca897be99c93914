#pragma once

#include <vector>

#include "trihedron/io/schema.hpp"

namespace trihedron::cli {

/// Of the files, and of what --json prints: "inspect-output", "calibrate-output" and so on.
[[nodiscard]] std::vector<io::Schema> all_schemas();

}  // namespace trihedron::cli
