#pragma once
/// The passes of one command, with a name and, where they are simulated, their truth.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/io/pass.hpp"

namespace trihedron::io {

/// A pass and its truth, with the name under which results are kept. The name is that of one directory or file in any
/// directory, never "." or ".." (then it is that of the directory they stand for), and valid UTF-8: bytes of a file
/// name that are not, and control characters, become
/// "%" and two hexadecimal digits.
struct NamedPass {
  std::filesystem::path path;
  std::string name;  ///< of its directory or file as it was given; numbered where several have the same
  LoadedPass loaded;
  std::optional<Truth> truth;

  [[nodiscard]] const Pass& pass() const { return loaded.pass; }
  /// Null where there is none.
  [[nodiscard]] const Truth* truth_or_null() const { return truth ? &*truth : nullptr; }
};

/// What becomes of a truth of which a part is missing: a file, a column, a key. One that is broken, or of another
/// number of gyros, is refused in any case.
enum class TruthUse {
  kNeeded,     ///< InputRefused
  kToCompare,  ///< a defect of the pass, which then has no truth
};

/// Throws as read_pass and, where the truth is needed, as read_truth. The truth is that between the two ends of the
/// selection.
[[nodiscard]] NamedPass read_named_pass(const std::filesystem::path& path, TruthUse use = TruthUse::kNeeded,
                                        const Selection& selection = {});

/// In the order of their epochs, with names that differ from each other and from the `reserved`, their truth to
/// compare. Throws as read_pass.
[[nodiscard]] std::vector<NamedPass> read_passes(const std::vector<std::string>& paths,
                                                 std::span<const std::string_view> reserved = {});

}  // namespace trihedron::io
