#pragma once
/// The text of a CCSDS message, as KVN or XML.

#include <fmt/format.h>

#include <numbers>
#include <string>
#include <string_view>

#include "trihedron/io/attitude_message.hpp"

namespace trihedron::io {

/// Messages have angles in degrees.
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

/// Printable ASCII and not blank, which is all that a message may hold: throws UsageError, with `what` for its subject.
void expect_plain(std::string_view text, std::string_view what);

/// Appends what both syntaxes have in common.
class NdmText {
 public:
  explicit NdmText(MessageSyntax syntax) : kvn_(syntax == MessageSyntax::kKvn) {}

  [[nodiscard]] bool kvn() const { return kvn_; }
  [[nodiscard]] fmt::memory_buffer& buffer() { return out_; }
  [[nodiscard]] std::string text() const { return fmt::to_string(out_); }

  void put(std::string_view text) { out_.append(text.data(), text.data() + text.size()); }
  /// One or the other, by the syntax.
  void put(std::string_view kvn, std::string_view xml) { put(kvn_ ? kvn : xml); }
  /// `KEY = value [units]` or `<KEY units="units">value</KEY>`; COMMENT without the equals sign.
  void entry(std::string_view key, std::string_view value, std::string_view units = {});
  /// First lines up to the end of the header; `kind` is "AEM" or "ACM".
  void header(std::string_view kind, std::string_view comment, const MessageDescription& description);
  void end(std::string_view kind);

 private:
  bool kvn_;
  fmt::memory_buffer out_;
};

[[nodiscard]] std::string escaped_for_xml(std::string_view text);

}  // namespace trihedron::io
