#include "json_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "text_file.hpp"
#include "wording.hpp"

namespace trihedron::io {

Json parse_json(std::string_view text, const std::filesystem::path& file) {
  refuse_other_than_text(text, file);
  try {
    return Json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const std::string_view before = text.substr(0, error.byte > 0 ? error.byte - 1 : 0);
    const auto line = std::ranges::count(before, '\n') + 1;
    const auto column = static_cast<std::int64_t>(before.size() - (before.rfind('\n') + 1)) + 1;
    throw InputRefused(file, {line, column}, "is not valid JSON here", "repair the JSON syntax");
  } catch (const nlohmann::json::out_of_range&) {
    throw InputRefused(file, {}, "holds a number too large for a double", "repair the number");
  }
}

JsonNode JsonNode::at(const std::string& key) const {
  const std::optional<JsonNode> member = find(key);
  if (!member) {
    throw InputIncomplete(file_, {}, at_path(fmt::format("lacks key \"{}\"", key)), "add it");
  }
  return *member;
}

std::optional<JsonNode> JsonNode::find(const std::string& key) const {
  if (!value_->is_object()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it an object");
  }
  const auto member = value_->find(key);
  if (member == value_->end()) {
    return std::nullopt;
  }
  return JsonNode(*member, file_, path_.empty() ? key : path_ + "." + key);
}

std::vector<JsonNode> JsonNode::elements() const {
  if (!value_->is_array()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it an array");
  }
  std::vector<JsonNode> nodes;
  nodes.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i) {
    nodes.emplace_back((*value_)[i], file_, fmt::format("{}[{}]", path_, i));
  }
  return nodes;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::members() const {
  if (!value_->is_object()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it an object");
  }
  std::vector<std::pair<std::string, JsonNode>> nodes;
  for (const auto& [key, value] : value_->items()) {
    nodes.emplace_back(key, JsonNode(value, file_, path_ + "." + key));
  }
  return nodes;
}

std::string JsonNode::text() const {
  if (!value_->is_string()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it a string");
  }
  return value_->get<std::string>();
}

bool JsonNode::boolean() const {
  if (!value_->is_boolean()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it true or false");
  }
  return value_->get<bool>();
}

double JsonNode::number() const {
  if (!value_->is_number()) {
    refuse(fmt::format("is {}", value_->type_name()), "make it a finite number");
  }
  return value_->get<double>();
}

double JsonNode::number(const Range& range) const {
  const double value = number();
  if (!range.holds(value)) {
    refuse(is_outside(value, range), std::string(range.why));
  }
  return value;
}

std::vector<double> JsonNode::numbers() const {
  std::vector<double> values;
  for (const JsonNode& element : elements()) {
    values.push_back(element.number());
  }
  return values;
}

Eigen::Vector3d JsonNode::vector3() const {
  const std::vector<double> values = numbers();
  if (values.size() != 3) {
    refuse(fmt::format("has {} elements", values.size()), "give three numbers: [x, y, z]");
  }
  return {values[0], values[1], values[2]};
}

Eigen::Vector3d JsonNode::vector3(const Range& range) const {
  Eigen::Vector3d vector = vector3();
  const std::vector<JsonNode> nodes = elements();
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    vector(i) = nodes[static_cast<std::size_t>(i)].number(range);
  }
  return vector;
}

void JsonNode::refuse(const std::string& reason, std::string cure) const {
  throw InputRefused(file_, {}, at_path(reason), std::move(cure));
}

std::string JsonNode::at_path(const std::string& reason) const {
  return path_.empty() ? reason : fmt::format("{} {}", path_, reason);
}

std::string dump(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json to_json_array(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

}  // namespace trihedron::io
