#include "trihedron/io/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace trihedron::io {
namespace {

/// Names and field texts come from files: whatever is in them, the message stays one line.
std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

std::string place(const std::filesystem::path& file, Position position) {
  std::string text = file.string();
  if (position.line > 0) {
    text += fmt::format(":{}", position.line);
    if (position.column > 0) {
      text += fmt::format(":{}", position.column);
    }
  }
  return text;
}

}  // namespace

InputRefused::InputRefused(std::filesystem::path file, Position position, std::string reason, std::string cure)
    : std::runtime_error(one_line(fmt::format("{}: {}; {}", place(file, position), reason, cure))),
      file_(std::move(file)),
      position_(position),
      reason_(std::move(reason)),
      cure_(std::move(cure)) {}

MachineFailed::MachineFailed(std::filesystem::path file, std::string reason, std::string cure)
    : std::runtime_error(one_line(fmt::format("{}: {}; {}", file.string(), reason, cure))),
      file_(std::move(file)),
      reason_(std::move(reason)),
      cure_(std::move(cure)) {}

}  // namespace trihedron::io
