#include "toml_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "text_file.hpp"
#include "trihedron/records/text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

std::string_view type_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

void check_version(const TomlTable& root, const toml::node& node) {
  const auto* const version = node.as_integer();
  if (version == nullptr) {
    root.refuse(node, fmt::format("\"{}\" is {}", kVersionKey, type_of(node)),
                fmt::format("make it a whole number, {}", kTomlVersion));
  }
  if (version->get() != kTomlVersion) {
    root.refuse(node, fmt::format("\"{}\" is {}, this program reads {}", kVersionKey, version->get(), kTomlVersion),
                "use the program that wrote the file, or a newer one");
  }
}

}  // namespace

UnknownKey::UnknownKey(const std::filesystem::path& file, Position position, std::string key, const std::string& table,
                       std::string_view meant, std::span<const std::string_view> known)
    : InputRefused(file, position, fmt::format("key {} is not known in {}", in_quotes(key), table),
                   suggestion(key, known)),
      key_(std::move(key)),
      is_like_another_(!meant.empty()) {}

void TomlTable::expect_known(const std::vector<std::string_view>& known) const {
  for (const auto& [key, node] : table_) {
    if (std::ranges::find(known, key.str()) == known.end()) {
      throw UnknownKey(file_, position_of(key.source()), std::string(key.str()), name_, nearest(key.str(), known),
                       known);
    }
  }
}

const toml::node& TomlTable::at(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) {
    refuse(table_, fmt::format("key \"{}\" is missing in {}", key, name_), "add it");
  }
  return *node;
}

const toml::table& TomlTable::as_table(const toml::node& node, std::string_view key) const {
  const toml::table* table = node.as_table();
  if (table == nullptr) {
    refuse(node, fmt::format("\"{}\" is {}", key, type_of(node)), "make it a table");
  }
  return *table;
}

const toml::table& TomlTable::table_at(std::string_view key) const { return as_table(at(key), key); }

std::string TomlTable::text(const toml::node& node, std::string_view key) const {
  const auto* value = node.as_string();
  if (value == nullptr) {
    refuse(node, fmt::format("\"{}\" is {}", key, type_of(node)), "make it a string");
  }
  return value->get();
}

double TomlTable::number(const toml::node& node, std::string_view key, const Range& range) const {
  const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value) {
    refuse(node, fmt::format("\"{}\" is {}", key, type_of(node)),
           "make it a number; its unit is in the name of the key");
  }
  if (!std::isfinite(*value)) {
    refuse(node, fmt::format("\"{}\" is not finite", key), "give a finite number");
  }
  if (!range.holds(*value)) {
    refuse<InputOutsideRange>(node, fmt::format("\"{}\" {}", key, is_outside(*value, range)), std::string(range.why));
  }
  return *value;
}

Eigen::Vector3d TomlTable::three_numbers(const toml::node& node, std::string_view key, const Range& range) const {
  const toml::array* array = node.as_array();
  if (array == nullptr || array->size() != 3) {
    refuse(node,
           array == nullptr ? fmt::format("\"{}\" is {}", key, type_of(node))
                            : fmt::format("\"{}\" has {} elements", key, array->size()),
           "give three numbers: [x, y, z]");
  }
  return {number((*array)[0], key, range), number((*array)[1], key, range), number((*array)[2], key, range)};
}

toml::table parse_toml(std::string_view text, const std::filesystem::path& file) {
  refuse_other_than_text(text, file);
  try {
    toml::table document = toml::parse(text, file.string());
    if (const toml::node* const version = document.get(kVersionKey)) {
      check_version(TomlTable(document, file, "the file"), *version);
      document.erase(kVersionKey);
    }
    return document;
  } catch (const toml::parse_error& error) {
    throw InputRefused(file, position_of(error.source()), std::string(error.description()), "repair the TOML syntax");
  }
}

}  // namespace trihedron::io
