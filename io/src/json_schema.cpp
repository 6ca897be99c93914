#include "json_schema.hpp"

#include <fmt/format.h>

#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/estimator.hpp"

namespace trihedron::io {

Json text_schema() { return {{"type", "string"}}; }

Json number_schema(const Range& range) {
  Json schema = {{"type", "number"}};
  if (range.least > kAnyNumber.least) {
    schema["minimum"] = range.least;
  }
  if (range.most < kAnyNumber.most) {
    schema["maximum"] = range.most;
  }
  return range.zero_allowed ? any_of({{{"const", 0}}, schema}) : schema;
}

Json quantity_schema(const QuantityKind& kind) {
  return {{"type", "string"}, {"pattern", pattern_of(kind)}, {"examples", {kind.example}}};
}

Json array_of(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

Json three_of(Json items) {
  Json schema = array_of(std::move(items));
  schema["minItems"] = 3;
  schema["maxItems"] = 3;
  return schema;
}

Json one_of(std::span<const std::string_view> words) { return {{"enum", words}}; }

Json any_of(std::initializer_list<Json> schemas) {
  Json choices = Json::array();
  for (const Json& schema : schemas) {
    choices.push_back(schema);
  }
  return {{"anyOf", choices}};
}

Json epoch_schema() {
  return {{"type", "string"},
          {"pattern", R"(^[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}(\.[0-9]{1,9})?$)"},
          {"examples", {"2009-05-20T00:00:00"}}};
}

Json estimator_schema() {
  Json names = Json::array();
  for (const EstimatorRow& row : kEstimators) {
    names.push_back(row.name);
  }
  return {{"enum", names}};
}

Json drift_model_schema() { return {{"enum", drift_model_names()}}; }

Json object_of(std::initializer_list<Key> keys, const Json& more) {
  Json schema = {{"type", "object"}, {"properties", Json::object()}, {"required", Json::array()}};
  for (const Key& key : keys) {
    Json& property = schema["properties"][key.name] = key.schema;
    if (!key.about.empty()) {
      property["description"] = key.about;
    }
    if (key.is_required) {
      schema["required"].push_back(key.name);
    }
  }
  schema["additionalProperties"] = more;
  return schema;
}

void read_members(const JsonNode& object, const Members& members) {
  for (const Member& member : members) {
    const std::string key(member.key);
    if (member.is_required) {
      member.read(object.at(key));
    } else if (const auto value = object.find(key)) {
      member.read(*value);
    }
  }
}

Json schema_of(const Members& members) {
  Json schema = object_of({}, true);
  for (const Member& member : members) {
    Json& property = schema["properties"][std::string(member.key)] = member.schema;
    if (!member.about.empty()) {
      property["description"] = member.about;
    }
    if (member.is_required) {
      schema["required"].push_back(member.key);
    }
  }
  return schema;
}

Member optional_member(Member member) {
  member.is_required = false;
  return member;
}

Member version_member(int version) {
  return {"version", "of the format", {{"const", version}}, [version](const JsonNode& node) {
            if (const double found = node.number(); found != version) {
              node.refuse(fmt::format("is {}", found), fmt::format("this program reads version {}", version));
            }
          }};
}

Json document_schema(std::string_view title, std::string_view about, const Json& schema) {
  Json document = {
      {"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}, {"description", about}};
  document.update(schema);
  return document;
}

}  // namespace trihedron::io
