#pragma once
/// Strict reading of JSON: every refusal names the path of the value, like `gyros[0].drift_rad_s.k0`.

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/records/limits.hpp"

namespace trihedron::io {

/// Keeps the keys in the order of the file.
using Json = nlohmann::ordered_json;

/// Throws InputRefused with line and column of a syntax error.
[[nodiscard]] Json parse_json(std::string_view text, const std::filesystem::path& file);

/// A value inside a document, which must outlive it. Everything throws InputRefused when the value is not what is asked
/// for.
class JsonNode {
 public:
  JsonNode(const Json& value, std::filesystem::path file, std::string path = "")
      : value_(&value), file_(std::move(file)), path_(std::move(path)) {}

  [[nodiscard]] JsonNode at(const std::string& key) const;
  [[nodiscard]] std::optional<JsonNode> find(const std::string& key) const;
  [[nodiscard]] std::vector<JsonNode> elements() const;
  [[nodiscard]] std::vector<std::pair<std::string, JsonNode>> members() const;

  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool boolean() const;
  /// Finite.
  [[nodiscard]] double number() const;
  [[nodiscard]] double number(const Range& range) const;
  [[nodiscard]] bool is_null() const { return value_->is_null(); }
  [[nodiscard]] std::vector<double> numbers() const;
  [[nodiscard]] Eigen::Vector3d vector3() const;
  /// Each within the range.
  [[nodiscard]] Eigen::Vector3d vector3(const Range& range) const;

  [[noreturn]] void refuse(const std::string& reason, std::string cure) const;

 private:
  /// The reason, after the path of this node.
  [[nodiscard]] std::string at_path(const std::string& reason) const;

  const Json* value_;
  std::filesystem::path file_;
  std::string path_;
};

/// The text on one line. Invalid UTF-8 is replaced, so that a bad message cannot prevent the file from being written.
[[nodiscard]] std::string dump(const Json& value);

/// Three numbers as an array.
[[nodiscard]] Json to_json_array(const Eigen::Vector3d& v);

}  // namespace trihedron::io
