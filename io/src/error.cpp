#include "trihedron/io/error.hpp"

#include <fmt/format.h>

#include <utility>

#include "trihedron/records/text.hpp"

namespace trihedron::io {
namespace {

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
    : std::runtime_error(printable(fmt::format("{}: {}; {}", place(file, position), reason, cure))),
      file_(std::move(file)),
      position_(position),
      reason_(std::move(reason)),
      cure_(std::move(cure)) {}

MachineFailed::MachineFailed(std::filesystem::path file, std::string reason, std::string cure)
    : std::runtime_error(printable(fmt::format("{}: {}; {}", file.string(), reason, cure))),
      file_(std::move(file)),
      reason_(std::move(reason)),
      cure_(std::move(cure)) {}

}  // namespace trihedron::io
