#pragma once
/// Strict reading of TOML tables: known keys only, and every refusal names its line and column.

#include <toml++/toml.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/records/limits.hpp"

namespace trihedron::io {

/// One table of a document; the document must outlive it.
class TomlTable {
 public:
  /// `name` is for people: "[gyro]". Refuses every key that is not known, suggesting the nearest.
  TomlTable(const toml::table& table, std::filesystem::path file, std::string name,
            const std::vector<std::string_view>& known);

  [[nodiscard]] const toml::node* find(std::string_view key) const { return table_.get(key); }
  /// The value; refuses a missing key.
  [[nodiscard]] const toml::node& at(std::string_view key) const;
  [[nodiscard]] const toml::table& table_at(std::string_view key) const;
  [[nodiscard]] const toml::table& as_table(const toml::node& node, std::string_view key) const;

  [[nodiscard]] std::string text(const toml::node& node, std::string_view key) const;
  /// A finite number, integer or float.
  [[nodiscard]] double number(const toml::node& node, std::string_view key) const;
  /// Refuses a number outside the range.
  [[nodiscard]] double number(const toml::node& node, std::string_view key, const Range& range) const;
  /// Each within the range.
  [[nodiscard]] Eigen::Vector3d three_numbers(const toml::node& node, std::string_view key, const Range& range) const;

  [[noreturn]] void refuse(const toml::node& node, std::string reason, std::string cure) const;

 private:
  const toml::table& table_;
  std::filesystem::path file_;
  std::string name_;
};

/// Throws InputRefused with the place of a syntax error.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::filesystem::path& file);

}  // namespace trihedron::io
