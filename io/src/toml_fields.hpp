#pragma once
/// The keys of a TOML table, each with what it may hold and where its value goes: one list that is read by, and that
/// the JSON schema of the file is made of.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json_schema.hpp"
#include "quantity_kind.hpp"
#include "toml_table.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// A key. `schema` is of its value; `read` refuses a value that the schema does not allow, and may refuse more.
struct Field {
  std::string_view key;
  std::string_view about;  ///< for people
  std::function<Json()> schema;
  std::function<void(const TomlTable&, const toml::node&)> read;
  bool is_required = false;
};
using Fields = std::vector<Field>;

[[nodiscard]] Fields operator+(Fields a, const Fields& b);

/// Reads each key that the table has. Refuses a key that is not in the list, and the lack of one that is required.
/// `name` is for people: "[gyro]".
void read_fields(const toml::table& table, const std::filesystem::path& file, const std::string& name,
                 const Fields& fields);

/// Schema of a table with these keys and no other.
[[nodiscard]] Json schema_of(const Fields& fields);

/// Of a whole file, whose tables are `schema`.
[[nodiscard]] Json toml_file_schema(std::string_view title, std::string_view about, const Json& schema);

[[nodiscard]] Field required(Field field);

// Values. A target is written when the key is read, and must live until then.

[[nodiscard]] Field text(std::string_view key, std::string& target, std::string_view about);
[[nodiscard]] Field one_number(std::string_view key, double& target, const Range& range, std::string_view about);
[[nodiscard]] Field number_of_seconds(std::string_view key, Duration& target, const Range& range,
                                      std::string_view about);
/// An ISO date and time, as a text or as TOML has it.
[[nodiscard]] Field epoch(std::string_view key, Time& target, std::string_view about);
/// Numbers along or about x, y, z.
[[nodiscard]] Field three_numbers(std::string_view key, Eigen::Vector3d& target, const Range& range,
                                  std::string_view about);
[[nodiscard]] Field three_numbers(std::string_view key, std::optional<Eigen::Vector3d>& target, const Range& range,
                                  std::string_view about);
/// Any number of them.
[[nodiscard]] Field list_of_texts(std::string_view key, std::vector<std::string>& target, std::string_view about);
[[nodiscard]] Field list_of_numbers(std::string_view key, std::vector<double>& target, std::string_view about);
/// A number of something.
[[nodiscard]] Field whole(std::string_view key, int& target, const Range& range, std::string_view about);

// Values with a unit in a text, in the range of their kind unless another is told.

[[nodiscard]] Field quantity(std::string_view key, double& target, const QuantityKind& kind, std::string_view about);
[[nodiscard]] Field quantity(std::string_view key, double& target, const QuantityKind& kind, const Range& range,
                             std::string_view about);
[[nodiscard]] Field quantity(std::string_view key, std::optional<double>& target, const QuantityKind& kind,
                             std::string_view about);
[[nodiscard]] Field quantity(std::string_view key, std::optional<double>& target, const QuantityKind& kind,
                             const Range& range, std::string_view about);
/// Not negative.
[[nodiscard]] Field duration(std::string_view key, Duration& target, const Range& range_s, std::string_view about);
/// In seconds; it may be negative where the range allows it.
[[nodiscard]] Field signed_duration(std::string_view key, double& target_s, std::string_view about);
[[nodiscard]] Field signed_duration(std::string_view key, double& target_s, const Range& range_s,
                                    std::string_view about);
[[nodiscard]] Field three_quantities(std::string_view key, Eigen::Vector3d& target, const QuantityKind& kind,
                                     std::string_view about);
[[nodiscard]] Field three_quantities(std::string_view key, Eigen::Vector3d& target, const QuantityKind& kind,
                                     const Range& range, std::string_view about);
[[nodiscard]] Field three_quantities(std::string_view key, std::optional<Eigen::Vector3d>& target,
                                     const QuantityKind& kind, std::string_view about);

/// The text of a value with a unit; refuses a bare number.
[[nodiscard]] std::string quantity_text(const TomlTable& table, const toml::node& node, std::string_view key);

/// Any whole number that its type holds.
template <class Integer>
[[nodiscard]] Field whole(std::string_view key, Integer& target, std::string_view about) {
  static constexpr Integer kLeast = std::numeric_limits<Integer>::min();
  // TOML has no larger one.
  static constexpr auto kMost = static_cast<Integer>(
      std::min<std::uint64_t>(std::numeric_limits<Integer>::max(), std::numeric_limits<std::int64_t>::max()));
  return {key, about, [] { return whole_schema(kLeast, kMost); },
          [key, &target](const TomlTable& table, const toml::node& node) {
            const std::optional<Integer> value = node.is_integer() ? node.value<Integer>() : std::nullopt;
            if (!value) {
              table.refuse(node, fmt::format("\"{}\" is not a whole number in range", key),
                           fmt::format("give a whole number from {} to {}", kLeast, kMost));
            }
            target = *value;
          }};
}

[[noreturn]] void refuse_word(const TomlTable& table, const toml::node& node, std::string_view key,
                              std::span<const std::string_view> words);

/// One word of a list.
template <class T>
[[nodiscard]] Field choice(std::string_view key, T& target, std::string_view about,
                           std::vector<std::pair<std::string_view, T>> words) {
  std::vector<std::string_view> known;
  for (const auto& [word, value] : words) {
    known.push_back(word);
  }
  return {key, about, [known] { return one_of(known); },
          [key, &target, words = std::move(words), known](const TomlTable& table, const toml::node& node) {
            const std::string given = table.text(node, key);
            for (const auto& [word, value] : words) {
              if (given == word) {
                target = value;
                return;
              }
            }
            refuse_word(table, node, key, known);
          }};
}

// Tables.

[[nodiscard]] Field section(std::string_view key, const std::filesystem::path& file, std::string name,
                            std::string_view about, const std::function<Fields()>& fields);

/// The element tables; refuses what is no array of tables, or an empty one unless `may_be_empty`.
[[nodiscard]] std::vector<const toml::table*> tables_of(const TomlTable& table, const toml::node& node,
                                                        std::string_view key, const std::string& cure);

/// An array of tables, each read by its own fields into a new element.
template <class T, class FieldsOf>
[[nodiscard]] Field list(std::string_view key, const std::filesystem::path& file, std::vector<T>& target,
                         std::string_view about, FieldsOf fields) {
  return {
      key, about,
      [fields] {
        T element{};
        return array_of(schema_of(fields(element)));
      },
      [key, &file, &target, fields](const TomlTable& table, const toml::node& node) {
        target.clear();
        for (const toml::table* element : tables_of(table, node, key, fmt::format("begin each with [[…{}]]", key))) {
          read_fields(*element, file, fmt::format("\"{}\" {}", key, target.size() + 1), fields(target.emplace_back()));
        }
      }};
}

}  // namespace trihedron::io
