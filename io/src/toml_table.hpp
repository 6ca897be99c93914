#pragma once
/// Strict reading of TOML tables: every refusal names its line and column.

#include <toml++/toml.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json_schema.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {

[[nodiscard]] inline Position position_of(const toml::source_region& region) {
  return {static_cast<std::int64_t>(region.begin.line), static_cast<std::int64_t>(region.begin.column)};
}

/// A key that a table does not know. Who knows more of the document than that table may tell a better cure.
class UnknownKey : public InputRefused {
 public:
  UnknownKey(const std::filesystem::path& file, Position position, std::string key, const std::string& table,
             std::string_view meant, std::span<const std::string_view> known);
  /// Of the same key.
  UnknownKey(const UnknownKey& unknown, std::string cure)
      : InputRefused(unknown.file(), unknown.position(), unknown.reason(), std::move(cure)),
        key_(unknown.key_),
        is_like_another_(unknown.is_like_another_) {}

  [[nodiscard]] const std::string& key() const { return key_; }
  /// Whether it is like a key that its table knows.
  [[nodiscard]] bool is_like_another() const { return is_like_another_; }

 private:
  std::string key_;
  bool is_like_another_;
};

/// One table of a document; the document must outlive it.
class TomlTable {
 public:
  /// `name` is for people: "[gyro]".
  TomlTable(const toml::table& table, std::filesystem::path file, std::string name)
      : table_(table), file_(std::move(file)), name_(std::move(name)) {}

  /// Refuses every key that is not known, by an UnknownKey that suggests the nearest.
  void expect_known(const std::vector<std::string_view>& known) const;

  [[nodiscard]] const toml::node* find(std::string_view key) const { return table_.get(key); }
  /// The value; refuses a missing key.
  [[nodiscard]] const toml::node& at(std::string_view key) const;
  [[nodiscard]] const toml::table& table_at(std::string_view key) const;
  [[nodiscard]] const toml::table& as_table(const toml::node& node, std::string_view key) const;

  [[nodiscard]] std::string text(const toml::node& node, std::string_view key) const;
  /// A finite number of the range, integer or float.
  [[nodiscard]] double number(const toml::node& node, std::string_view key, const Range& range = kAnyNumber) const;
  [[nodiscard]] Eigen::Vector3d three_numbers(const toml::node& node, std::string_view key,
                                              const Range& range = kAnyNumber) const;

  template <class Refused = InputRefused>
  [[noreturn]] void refuse(const toml::node& node, std::string reason, std::string cure) const {
    throw Refused(file_, position_of(node.source()), std::move(reason), std::move(cure));
  }

 private:
  const toml::table& table_;
  std::filesystem::path file_;
  std::string name_;
};

/// The key before all tables that holds the version of the format, and the one that is read and written;
/// docs/formats.md.
inline constexpr std::string_view kVersionKey = "version";
inline constexpr std::int64_t kTomlVersion = 1;

/// Without the version, which is checked. Throws InputRefused with the place of a syntax error, or of another version.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::filesystem::path& file);

}  // namespace trihedron::io
