#pragma once
/// A CCSDS message of one segment, KVN or XML, as blocks of keywords: what ACM and APM have in common.

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_scale.hpp"

namespace trihedron::io {

struct NdmEntry {
  std::string value;
  std::string units;  ///< empty where none are told
  Position at;
};

/// A line of data.
struct NdmRow {
  std::string text;
  Position at;
};

struct NdmBlock {
  std::string name;  ///< of KVN: "ATT", "USER"; "header", "metadata", "data" outside of those
  Position at;
  std::map<std::string, NdmEntry, std::less<>> entries;  ///< user-defined ones as "USER_DEFINED_NAME"
  std::vector<NdmRow> rows;
};

/// What makes a message of its kind.
struct NdmKind {
  std::string_view name;  ///< "ACM"
  /// Names of its blocks in KVN and XML. A block within a block, such as that of a sensor, is not among them.
  std::span<const std::pair<std::string_view, std::string_view>> blocks;
  std::span<const std::string_view> metadata;  ///< its keywords
  bool delimits_metadata = true;               ///< whether META_START and META_STOP must stand about them in KVN
};

/// Each function throws InputRefused for what is wrong.
class NdmMessage {
 public:
  /// Version 2.0 only.
  NdmMessage(std::string_view text, const std::filesystem::path& file, const NdmKind& kind);

  std::string format;            ///< for people: "CCSDS ACM version 2, KVN"
  std::vector<NdmRow> comments;  ///< of the header
  NdmBlock header;
  NdmBlock metadata;
  NdmBlock data;  ///< what stands outside its blocks
  std::vector<NdmBlock> blocks;
  Position end;

  [[noreturn]] void refuse(Position at, std::string reason, std::string cure) const;
  /// The only block of a name; nullptr where there is none.
  [[nodiscard]] const NdmBlock* block(std::string_view name) const;
  [[nodiscard]] const NdmEntry& needed(const NdmBlock& block, std::string_view key) const;
  /// Its unit may be left out.
  [[nodiscard]] double number(const NdmBlock& block, std::string_view key, std::string_view unit = {}) const;
  [[nodiscard]] double number(std::string_view text, Position at) const;
  [[nodiscard]] TimeScale time_scale() const;
  [[nodiscard]] Time time(TimeText& clock, std::string_view text, Position at) const;
  /// Names of REF_FRAME_A and REF_FRAME_B, normalised, of which one must be inertial and the other of the spacecraft.
  [[nodiscard]] std::pair<std::string, std::string> frames(const NdmBlock& block) const;

 private:
  friend class NdmKvnReader;
  friend class NdmXmlReader;
  void expect_version(std::string_view version, Position at) const;
  void add(NdmBlock& block, std::string_view key, std::string_view value, std::string_view units, Position at) const;
  void check() const;

  std::filesystem::path file_;
  NdmKind kind_;
};

/// "AEM", "ACM" …: the kind of message that a text says it is; empty where it says none.
[[nodiscard]] std::string_view ndm_kind(std::string_view text);

}  // namespace trihedron::io
