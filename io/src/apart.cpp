#include "trihedron/io/apart.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

bool is_same(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored);
}

/// Absolute, and without links as far as it is there.
fs::path resolved(const fs::path& path) {
  std::error_code fault;
  const fs::path absolute = fs::absolute(path, fault);
  fs::path whole = fs::weakly_canonical(absolute, fault);
  return fault ? absolute.lexically_normal() : whole;
}

bool lies_in(const fs::path& path, const fs::path& directory) {
  for (fs::path above = resolved(path); above.has_relative_path(); above = above.parent_path()) {
    if (is_same(above, directory)) {
      return true;
    }
  }
  return is_same("/", directory);
}

/// Whether the file has another name in the directory.
bool is_linked_into(const fs::path& file, const fs::path& directory) {
  std::error_code fault;
  if (!fs::is_regular_file(file, fault) || fs::hard_link_count(file, fault) < 2) {
    return false;
  }
  for (fs::directory_iterator entry(directory, fault), end; !fault && entry != end; entry.increment(fault)) {
    if (is_same(entry->path(), file)) {
      return true;
    }
  }
  return false;
}

bool is_device(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

[[noreturn]] void refuse(const fs::path& output, const std::string& reason) {
  throw UsageError(fmt::format("{}: {}; give another output", output.string(), reason));
}

void expect_apart(const fs::path& output, const fs::path& other, std::string_view what) {
  std::error_code ignored;
  if (output.empty() || other.empty() || is_device(output)) {
    return;
  }
  if (is_same(output, other) || resolved(output) == resolved(other)) {
    refuse(output, fmt::format("the output is the {} {} as well and would replace it", what, other.string()));
  }
  if (fs::is_directory(other, ignored) && (lies_in(output, other) || is_linked_into(output, other))) {
    refuse(output, fmt::format("the output lies in the {} {}", what, other.string()));
  }
}

}  // namespace

void expect_apart(std::span<const fs::path> inputs, std::span<const fs::path> outputs) {
  for (const fs::path& output : outputs) {
    for (const fs::path& input : inputs) {
      expect_apart(output, input, "input");
    }
  }
}

void expect_apart_from_each_other(std::span<const fs::path> outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (std::size_t j = 0; j < outputs.size(); ++j) {
      if (i != j) {
        expect_apart(outputs[i], outputs[j], "other output");
      }
    }
  }
}

}  // namespace trihedron::io
