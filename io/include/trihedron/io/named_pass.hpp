#pragma once
/// The passes of one command, with a name and, where they are simulated, their truth.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/io/pass.hpp"

namespace trihedron::io {

/// A pass and its truth, with the name under which results are kept.
struct NamedPass {
  std::filesystem::path path;
  std::string name;  ///< of its directory or file; numbered where several have the same
  LoadedPass loaded;
  std::optional<Truth> truth;

  [[nodiscard]] const Pass& pass() const { return loaded.pass; }
  /// Null where there is none.
  [[nodiscard]] const Truth* truth_or_null() const { return truth ? &*truth : nullptr; }
};

/// Throws as read_pass and read_truth, and InputRefused for a truth of another number of gyros.
[[nodiscard]] NamedPass read_named_pass(const std::filesystem::path& path);

/// In the order of their epochs. Throws as read_named_pass.
[[nodiscard]] std::vector<NamedPass> read_passes(const std::vector<std::string>& paths);

}  // namespace trihedron::io
