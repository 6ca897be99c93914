#pragma once
/// JSON schemas (draft 2020-12) of the TOML and JSON files that this module reads and writes. Its readers go by the
/// same tables: a key that a schema does not allow is refused, and the other way round.

#include <functional>
#include <string>
#include <vector>

namespace trihedron::io {
/// A JSON schema.
struct Schema {
  std::string name;                   ///< "pass", "calibration"
  std::function<std::string()> text;  ///< JSON; made when it is asked for, which few commands do
};
/// Of each JSON and TOML file that is read or written.
[[nodiscard]] std::vector<Schema> schemas();

}  // namespace trihedron::io
