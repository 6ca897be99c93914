#pragma once
/// Lines and bytes of a CCSDS message, and where they stand.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <pugixml.hpp>
#include <string_view>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {

/// The lines of a text, which end with CR, LF, CRLF or LFCR.
class NdmLines {
 public:
  explicit NdmLines(std::string_view text) : rest_(text) {}

  /// The next line that is not blank; nothing at the end.
  std::optional<std::string_view> next() {
    while (!rest_.empty()) {
      check_stop();
      ++number_;
      const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
      const std::string_view line = rest_.substr(0, end);
      std::size_t skipped = end;
      if (end < rest_.size()) {
        const bool two = end + 1 < rest_.size() && rest_[end + 1] != rest_[end] &&
                         (rest_[end + 1] == '\r' || rest_[end + 1] == '\n');
        skipped += two ? 2 : 1;
      }
      begin_ = line.data();
      rest_.remove_prefix(skipped);
      if (!trimmed(line).empty()) {
        return line;
      }
    }
    ++number_;
    begin_ = nullptr;
    return std::nullopt;
  }

  [[nodiscard]] Position at(std::string_view word) const {
    return {number_, begin_ == nullptr ? 0 : word.data() - begin_ + 1};
  }
  [[nodiscard]] Position here() const { return {number_, 0}; }

 private:
  std::string_view rest_;
  const char* begin_ = nullptr;
  std::int64_t number_ = 0;
};

/// Where bytes of a text stand.
class NdmPlaces {
 public:
  explicit NdmPlaces(std::string_view text) {
    lines_.push_back(0);
    for (std::size_t i = text.find('\n'); i != std::string_view::npos; i = text.find('\n', i + 1)) {
      lines_.push_back(i + 1);
    }
  }
  [[nodiscard]] Position of(std::ptrdiff_t offset) const {
    const auto byte = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
    const auto after = std::ranges::upper_bound(lines_, byte);
    return {after - lines_.begin(), static_cast<std::int64_t>(byte - *(after - 1)) + 1};
  }

 private:
  std::vector<std::size_t> lines_;
};

/// Without the prefix of a namespace.
inline std::string_view ndm_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);  // npos + 1 == 0
}

inline bool is_ndm_element(const pugi::xml_node& node) { return node.type() == pugi::node_element; }

}  // namespace trihedron::io
