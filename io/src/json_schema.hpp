#pragma once
/// Parts of JSON schemas (draft 2020-12).

#include <concepts>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json_node.hpp"
#include "quantity_kind.hpp"
#include "trihedron/records/limits.hpp"

namespace trihedron::io {

inline constexpr Range kAnyNumber{};

[[nodiscard]] Json text_schema();
[[nodiscard]] Json number_schema(const Range& range = kAnyNumber);
[[nodiscard]] Json quantity_schema(const QuantityKind& kind);
[[nodiscard]] Json array_of(Json items);
[[nodiscard]] Json three_of(Json items);
[[nodiscard]] Json one_of(std::span<const std::string_view> words);
[[nodiscard]] Json any_of(std::initializer_list<Json> schemas);
template <std::integral Integer>
[[nodiscard]] Json whole_schema(Integer least, Integer most) {
  return {{"type", "integer"}, {"minimum", least}, {"maximum", most}};
}
/// Of an ISO date and time without time zone.
[[nodiscard]] Json epoch_schema();

/// Of the names of estimators and of drift models.
[[nodiscard]] Json estimator_schema();
[[nodiscard]] Json drift_model_schema();

/// A key of an object.
struct Key {
  std::string name;
  std::string_view about;
  Json schema;
  bool is_required = true;
};
/// An object with these keys; `more`: the schema of those that are not named, false where there are none.
[[nodiscard]] Json object_of(std::initializer_list<Key> keys, const Json& more = false);

/// A key of a JSON object that is read: `read` refuses a value that the schema does not allow, and may refuse more.
struct Member {
  std::string_view key;
  std::string_view about;  ///< for people
  Json schema;
  std::function<void(const JsonNode&)> read;
  bool is_required = true;
};
using Members = std::vector<Member>;

/// Reads the members in their order; refuses the lack of one that is required. Others are left alone: a newer program
/// may have written them.
void read_members(const JsonNode& object, const Members& members);

/// Schema of an object with these members, and others.
[[nodiscard]] Json schema_of(const Members& members);

/// "version", of the format of the file, which must be this one.
[[nodiscard]] Member version_member(int version);

[[nodiscard]] Member optional_member(Member member);

/// The schema of a whole file.
[[nodiscard]] Json document_schema(std::string_view title, std::string_view about, const Json& schema);

}  // namespace trihedron::io
