#include <fmt/format.h>

#include <array>
#include <optional>

#include "aem_builder.hpp"
#include "aem_syntax.hpp"
#include "ndm_places.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::size_t kMostFields = 9;  // of a data line

/// One AEM as text, line by line.
class Kvn {
 public:
  Kvn(std::string_view text, const std::filesystem::path& file) : lines_(text), file_(file) {}

  AttitudeMessage read() {
    AemBuilder builder = begun();
    std::optional<std::string_view> line;
    bool in_header = true;
    while ((line = lines_.next())) {
      const std::string_view words = trimmed(*line);
      if (words == "META_START") {
        in_header = false;
        builder.begin_segment(lines_.at(words));
        read_metadata(builder);
        read_data(builder);
      } else if (!in_header) {
        builder.refuse(lines_.at(words), fmt::format("{} stands outside metadata and data", in_quotes(words)),
                       "remove the line, or begin a segment with META_START");
      } else {
        read_assignment(builder, words, &AemBuilder::header);
      }
    }
    return builder.finish(lines_.here());
  }

 private:
  using Taker = void (AemBuilder::*)(AemField, AemField);

  [[nodiscard]] AemField field(std::string_view word) const { return {word, lines_.at(word)}; }

  AemBuilder begun() {
    const std::optional<std::string_view> line = lines_.next();
    const std::string_view words = line ? trimmed(*line) : std::string_view{};
    const std::size_t equals = words.find('=');
    if (equals == std::string_view::npos || trimmed(words.substr(0, equals)) != "CCSDS_AEM_VERS") {
      throw InputRefused(file_, lines_.at(words), "does not begin with CCSDS_AEM_VERS",
                         "give an attitude ephemeris message (AEM)");
    }
    return {file_, field(trimmed(words.substr(equals + 1))), "KVN"};
  }

  void read_assignment(AemBuilder& builder, std::string_view words, Taker take) {
    constexpr std::string_view kComment = "COMMENT";
    if (words == kComment || (words.starts_with(kComment) && words[kComment.size()] == ' ')) {
      builder.comment(trimmed(words.substr(kComment.size())));
      return;
    }
    const std::size_t equals = words.find('=');
    if (equals == std::string_view::npos) {
      builder.refuse(lines_.at(words), fmt::format("{} is no assignment", in_quotes(words)), "write KEYWORD = value");
    }
    const std::string_view value = trimmed(words.substr(equals + 1));
    if (value.ends_with(']')) {
      builder.refuse(lines_.at(value), "an AEM has no units", "remove the brackets and what is in them");
    }
    (builder.*take)(field(trimmed(words.substr(0, equals))), field(value));
  }

  void read_metadata(AemBuilder& builder) {
    while (const std::optional<std::string_view> line = lines_.next()) {
      const std::string_view words = trimmed(*line);
      if (words == "META_STOP") {
        builder.end_metadata(lines_.at(words));
        return;
      }
      read_assignment(builder, words, &AemBuilder::metadata);
    }
    builder.refuse(lines_.here(), "the file ends within metadata", "write the file again, as a whole");
  }

  void read_data(AemBuilder& builder) {
    std::optional<std::string_view> line = lines_.next();
    if (!line || trimmed(*line) != "DATA_START") {
      builder.refuse(line ? lines_.at(*line) : lines_.here(), "META_STOP is not followed by DATA_START",
                     "add it, and DATA_STOP after the data");
    }
    bool first = true;
    while ((line = lines_.next())) {
      const std::string_view words = trimmed(*line);
      if (words == "DATA_STOP") {
        builder.end_segment(lines_.at(words));
        return;
      }
      if (first && words.starts_with("COMMENT")) {
        continue;
      }
      first = false;
      read_row(builder, words);
    }
    builder.refuse(lines_.here(), "the file ends within data, without DATA_STOP", "write the file again, as a whole");
  }

  void read_row(AemBuilder& builder, std::string_view words) {
    std::array<AemField, kMostFields> fields;
    std::size_t count = 0;
    for (std::size_t begin = 0; begin < words.size();) {
      const std::size_t end = std::min(words.find_first_of(" \t", begin), words.size());
      if (count < fields.size()) {
        fields.at(count) = field(words.substr(begin, end - begin));
      }
      ++count;
      begin = std::min(words.find_first_not_of(" \t", end), words.size());
    }
    const std::size_t expected = columns_of(builder.kind());
    if (count != expected) {
      builder.refuse(lines_.at(words),
                     fmt::format("the line has {} value{}, not {}", count, count == 1 ? "" : "s", expected),
                     "an epoch and the numbers of ATTITUDE_TYPE stand in a line");
    }
    if (builder.scalar_first()) {
      std::rotate(fields.begin() + 1, fields.begin() + 2, fields.begin() + 5);
      if (builder.kind() == AemBuilder::Kind::kDerivative) {
        std::rotate(fields.begin() + 5, fields.begin() + 6, fields.begin() + 9);
      }
    }
    builder.row({fields.data(), count});
  }

  NdmLines lines_;
  const std::filesystem::path& file_;
};

}  // namespace

std::size_t columns_of(AemBuilder::Kind kind) {
  switch (kind) {
    case AemBuilder::Kind::kQuaternion:
      return 5;
    case AemBuilder::Kind::kDerivative:
      return 9;
    case AemBuilder::Kind::kAngularVelocity:
    case AemBuilder::Kind::kEulerRate:
      break;
  }
  return 8;
}

AttitudeMessage parse_aem_kvn(std::string_view text, const std::filesystem::path& file) {
  return Kvn(text, file).read();
}

}  // namespace trihedron::io
