#include "ndm_message.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "ccsds_frames.hpp"
#include "ndm_places.hpp"
#include "wording.hpp"

namespace trihedron::io {

/// Lines of KVN to the blocks of a message.
class NdmKvnReader {
 public:
  NdmKvnReader(std::string_view text, NdmMessage& message) : lines_(text), message_(message) {}

  void read() {
    const std::optional<std::string_view> first = lines_.next();
    const std::string_view words = first ? trimmed(*first) : std::string_view{};
    const std::size_t equals = words.find('=');
    const std::string keyword = fmt::format("CCSDS_{}_VERS", message_.kind_.name);
    if (equals == std::string_view::npos || trimmed(words.substr(0, equals)) != keyword) {
      message_.refuse(lines_.at(words), "does not begin with " + keyword, "give such a message");
    }
    message_.expect_version(trimmed(words.substr(equals + 1)), lines_.at(words));
    message_.header.at = lines_.at(words);
    NdmBlock* outside = &message_.header;
    while (const std::optional<std::string_view> line = lines_.next()) {
      const std::string_view word = trimmed(*line);
      if (word == "META_START") {
        if (outside != &message_.header) {
          message_.refuse(lines_.at(word), "a second segment begins", "give each a message of its own");
        }
        message_.metadata.at = lines_.at(word);
        read_block(message_.metadata, "META", false);
        outside = &message_.data;
        message_.data.at = lines_.here();
      } else if (NdmBlock* const begun = begun_without_delimiter(word, outside)) {
        outside = begun;
        outside->at = lines_.at(word);
        if (word.ends_with(kStart)) {
          begin_block(word);
        } else {
          assign(*outside, word);
        }
      } else if (word.ends_with(kStart) && outside == &message_.data) {
        begin_block(word);
      } else {
        assign(*outside, word);
      }
    }
    message_.end = lines_.here();
    if (outside == &message_.header) {
      message_.refuse(message_.end, "the file ends without metadata", "write the file again, as a whole");
    }
  }

 private:
  static constexpr std::string_view kStart = "_START";
  static constexpr std::string_view kStop = "_STOP";

  /// The section that a line begins by its keyword, where the kind of message has no delimiters; else nullptr.
  NdmBlock* begun_without_delimiter(std::string_view word, const NdmBlock* now) {
    if (message_.kind_.delimits_metadata || is_comment(word)) {
      return nullptr;
    }
    const std::string_view key = trimmed(word.substr(0, word.find('=')));
    const bool is_metadata = std::ranges::find(message_.kind_.metadata, key) != message_.kind_.metadata.end();
    if (now == &message_.header && is_metadata) {
      return &message_.metadata;
    }
    return now == &message_.metadata && !is_metadata ? &message_.data : nullptr;
  }

  void begin_block(std::string_view word) {
    const std::string_view name = word.substr(0, word.size() - kStart.size());
    const auto known = message_.kind_.blocks;
    const auto found = std::ranges::find(known, name, &std::pair<std::string_view, std::string_view>::first);
    if (found == known.end()) {
      message_.refuse(lines_.at(word), fmt::format("{} begins no block that there is", in_quotes(word)),
                      fmt::format("give one of those of an {}", message_.kind_.name));
    }
    NdmBlock block;
    block.name = name;
    block.at = lines_.at(word);
    read_block(block, block.name, true);
    message_.blocks.push_back(std::move(block));
  }

  void read_block(NdmBlock& block, std::string_view name, bool has_rows) {
    NdmBlock within;  // of a sensor
    while (const std::optional<std::string_view> line = lines_.next()) {
      const std::string_view word = trimmed(*line);
      const bool inside = !within.name.empty();
      if (word.ends_with(kStop)) {
        const std::string_view stopped = word.substr(0, word.size() - kStop.size());
        if (stopped != (inside ? std::string_view(within.name) : name)) {
          message_.refuse(lines_.at(word), fmt::format("{} ends a block that has not begun", word),
                          fmt::format("give {}_STOP before", inside ? within.name : name));
        }
        if (!inside) {
          return;
        }
        within = {};
      } else if (word == "SENSOR_START" && block.name == "AD" && !inside) {
        within.name = "SENSOR";
      } else if (has_rows && (name == "ATT" || name == "COV") && word.find('=') == std::string_view::npos &&
                 !is_comment(word)) {
        block.rows.push_back({std::string(word), lines_.at(word)});
      } else {
        assign(inside ? within : block, word);
      }
    }
    message_.refuse(lines_.here(), fmt::format("the file ends without {}_STOP", name),
                    "write the file again, as a whole");
  }

  static bool is_comment(std::string_view words) { return words == "COMMENT" || words.starts_with("COMMENT "); }

  void assign(NdmBlock& block, std::string_view words) {
    if (is_comment(words)) {
      if (&block == &message_.header) {
        message_.comments.push_back({std::string(trimmed(words.substr(std::string_view("COMMENT").size()))), {}});
      }
      return;
    }
    const std::size_t equals = words.find('=');
    if (equals == std::string_view::npos) {
      message_.refuse(lines_.at(words), fmt::format("{} is no assignment", in_quotes(words)), "write KEYWORD = value");
    }
    std::string_view value = trimmed(words.substr(equals + 1));
    std::string_view units;
    if (const std::size_t bracket = value.rfind('['); value.ends_with(']') && bracket != std::string_view::npos) {
      units = value.substr(bracket + 1, value.size() - bracket - 2);
      value = trimmed(value.substr(0, bracket));
    }
    message_.add(block, trimmed(words.substr(0, equals)), value, units, lines_.at(words));
  }

  NdmLines lines_;
  NdmMessage& message_;
};

/// Elements of XML to the same.
class NdmXmlReader {
 public:
  NdmXmlReader(std::string_view text, NdmMessage& message) : places_(text), message_(message) {
    const pugi::xml_parse_result parsed =
        document_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (parsed.status == pugi::status_out_of_memory) {
      throw std::bad_alloc();
    }
    if (!parsed) {
      message_.refuse(places_.of(parsed.offset), fmt::format("is no whole XML: {}", parsed.description()),
                      "write the file again, as a whole");
    }
    message_.end = places_.of(static_cast<std::ptrdiff_t>(text.size()));
  }

  void read() {
    const pugi::xml_node root = root_of_message();
    const std::string id = fmt::format("CCSDS_{}_VERS", message_.kind_.name);
    if (root.attribute("id").value() != id) {
      message_.refuse(at(root), fmt::format("its root has no id=\"{}\"", id), "add it, and the version");
    }
    message_.expect_version(root.attribute("version").value(), at(root));
    const pugi::xml_node head = pair_of(root, "header", "body");
    message_.header.at = at(head);
    take_all(message_.header, head);
    const pugi::xml_node segment = only_child(head.next_sibling(), "segment");
    const pugi::xml_node metadata = pair_of(segment, "metadata", "data");
    message_.metadata.at = at(metadata);
    take_all(message_.metadata, metadata);
    const pugi::xml_node data = metadata.next_sibling();
    message_.data.at = at(data);
    for (const pugi::xml_node& child : data.children()) {
      if (has_elements(child)) {
        read_block(child);
      } else {
        take(message_.data, child);
      }
    }
  }

 private:
  [[nodiscard]] Position at(const pugi::xml_node& node) const { return places_.of(node.offset_debug()); }

  static bool has_elements(const pugi::xml_node& node) { return is_ndm_element(node.first_child()); }

  [[noreturn]] void refuse_structure(const pugi::xml_node& node, std::string_view expected) const {
    message_.refuse(at(node), fmt::format("{} does not consist of {}", in_quotes(node.name()), expected),
                    fmt::format("give an {} of the standard's structure", message_.kind_.name));
  }

  [[nodiscard]] pugi::xml_node root_of_message() const {
    std::string tag(message_.kind_.name);
    std::ranges::transform(tag, tag.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    pugi::xml_node node = document_.document_element();
    if (ndm_name(node) == "ndm") {
      node = only_child(node, tag);
    }
    if (ndm_name(node) != tag) {
      message_.refuse(at(node), fmt::format("its root is {}", in_quotes(node.name())),
                      fmt::format("give a message <{}>", tag));
    }
    return node;
  }

  [[nodiscard]] pugi::xml_node only_child(const pugi::xml_node& node, std::string_view name) const {
    const pugi::xml_node child = node.first_child();
    if (ndm_name(child) != name || !child.next_sibling().empty()) {
      refuse_structure(node, fmt::format("one <{}>", name));
    }
    return child;
  }

  [[nodiscard]] pugi::xml_node pair_of(const pugi::xml_node& node, std::string_view first,
                                       std::string_view second) const {
    const pugi::xml_node child = node.first_child();
    const pugi::xml_node next = child.next_sibling();
    if (ndm_name(child) != first || ndm_name(next) != second || !next.next_sibling().empty()) {
      refuse_structure(node, fmt::format("<{}> and <{}>", first, second));
    }
    return child;
  }

  void read_block(const pugi::xml_node& node) {
    const auto known = message_.kind_.blocks;
    const auto found = std::ranges::find(known, ndm_name(node), &std::pair<std::string_view, std::string_view>::second);
    if (found == known.end()) {
      message_.refuse(at(node), fmt::format("<{}> is no block that there is", node.name()),
                      fmt::format("give one of those of an {}", message_.kind_.name));
    }
    NdmBlock block;
    block.name = found->first;
    block.at = at(node);
    for (const pugi::xml_node& child : node.children()) {
      if (!has_elements(child)) {
        take(block, child);
      } else if (block.name == "QUAT" || block.name == "ANGVEL") {
        take_all(block, child);
      }  // else a block within it, such as that of a sensor
    }
    message_.blocks.push_back(std::move(block));
  }

  void take_all(NdmBlock& block, const pugi::xml_node& node) {
    for (const pugi::xml_node& child : node.children()) {
      take(block, child);
    }
  }

  void take(NdmBlock& block, const pugi::xml_node& node) {
    check_stop();
    const pugi::xml_node text = node.first_child();
    if (!is_ndm_element(node) || !text.next_sibling().empty() ||
        (!text.empty() && text.type() != pugi::node_pcdata && text.type() != pugi::node_cdata)) {
      message_.refuse(at(node), fmt::format("{} holds more than a text", in_quotes(node.name())),
                      "give it a value alone");
    }
    std::string_view value = text.value();
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (!value.empty() && blank(value.front())) {
      value.remove_prefix(1);
    }
    while (!value.empty() && blank(value.back())) {
      value.remove_suffix(1);
    }
    const std::string_view name = ndm_name(node);
    if (name == "COMMENT") {
      if (&block == &message_.header) {
        message_.comments.push_back({std::string(value), {}});
      }
    } else if (name == "attLine" || name == "covLine") {
      block.rows.push_back({std::string(value), at(node)});
    } else if (name == "USER_DEFINED") {
      const std::string_view parameter = node.attribute("parameter").value();
      if (parameter.empty()) {
        message_.refuse(at(node), "<USER_DEFINED> has no parameter=\"NAME\"", "add it");
      }
      message_.add(block, fmt::format("USER_DEFINED_{}", parameter), value, node.attribute("units").value(), at(node));
    } else {
      message_.add(block, name, value, node.attribute("units").value(), at(node));
    }
  }

  pugi::xml_document document_;
  NdmPlaces places_;
  NdmMessage& message_;
};

NdmMessage::NdmMessage(std::string_view text, const std::filesystem::path& file, const NdmKind& kind)
    : file_(file), kind_(kind) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  const bool xml = text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size())).starts_with('<');
  header.name = "header";
  metadata.name = "metadata";
  data.name = "data";
  if (xml) {
    NdmXmlReader(text, *this).read();
  } else {
    NdmKvnReader(text, *this).read();
  }
  format = fmt::format("CCSDS {} version 2, {}", kind.name, xml ? "XML" : "KVN");
  check();
}

void NdmMessage::refuse(Position at, std::string reason, std::string cure) const {
  throw InputRefused(file_, at, std::move(reason), std::move(cure));
}

void NdmMessage::expect_version(std::string_view version, Position at) const {
  if (version != "2.0") {
    refuse(at, fmt::format("version {} of the {} is not known", in_quotes(version), kind_.name),
           "give a message of version 2.0");
  }
}

void NdmMessage::add(NdmBlock& block, std::string_view key, std::string_view value, std::string_view units,
                     Position at) const {
  if (value.empty()) {
    refuse(at, fmt::format("{} has no value", in_quotes(key)), "give one, or remove it");
  }
  if (!block.entries.try_emplace(std::string(key), NdmEntry{std::string(value), std::string(units), at}).second) {
    refuse(at, fmt::format("{} is there twice", in_quotes(key)), "keep one");
  }
}

void NdmMessage::check() const {
  constexpr std::array<std::string_view, 4> kOfHeader = {"CLASSIFICATION", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID"};
  for (const auto& [section, known] :
       {std::pair{&header, std::span<const std::string_view>(kOfHeader)}, std::pair{&metadata, kind_.metadata}}) {
    for (const auto& [key, entry] : section->entries) {
      if (std::ranges::find(known, key) == known.end()) {
        refuse(entry.at, fmt::format("{} is no keyword of the {} of an {}", in_quotes(key), section->name, kind_.name),
               suggestion(key, known));
      }
    }
  }
  const NdmEntry& created = needed(header, "CREATION_DATE");
  std::string_view date = created.value;
  date.remove_suffix(date.ends_with('Z') ? 1 : 0);
  TimeText::Fault fault;
  // By its form only: it may be later than the last leap second that is known.
  if (!TimeText(TimeScale::kTai).parse(date, fault)) {
    refuse(created.at, "CREATION_DATE: " + fault.reason, fault.cure);
  }
  static_cast<void>(needed(header, "ORIGINATOR"));
  static_cast<void>(needed(metadata, "OBJECT_NAME"));
}

const NdmBlock* NdmMessage::block(std::string_view name) const {
  const NdmBlock* result = nullptr;
  for (const NdmBlock& candidate : blocks) {
    if (candidate.name == name) {
      if (result != nullptr) {
        refuse(candidate.at, fmt::format("there is a second block {}", name), "keep one");
      }
      result = &candidate;
    }
  }
  return result;
}

const NdmEntry& NdmMessage::needed(const NdmBlock& block, std::string_view key) const {
  const auto found = block.entries.find(key);
  if (found == block.entries.end()) {
    refuse(block.at, fmt::format("{} has no {}", block.name, key), "add it, or write the file again");
  }
  return found->second;
}

double NdmMessage::number(std::string_view text, Position at) const {
  double value = 0;
  std::string_view digits = text;
  digits.remove_prefix(digits.starts_with('+') && !digits.starts_with("+-") ? 1 : 0);
  const auto [end_of_number, fault] = fast_float::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (fault != std::errc() || end_of_number != digits.data() + digits.size() || !std::isfinite(value)) {
    refuse(at, fmt::format("{} is not a number", in_quotes(text)), "repair it");
  }
  return value;
}

double NdmMessage::number(const NdmBlock& block, std::string_view key, std::string_view unit) const {
  const NdmEntry& entry = needed(block, key);
  if (!entry.units.empty() && entry.units != unit) {
    refuse(entry.at, fmt::format("the unit of {} is {}", key, in_quotes(entry.units)),
           unit.empty() ? "it has none: remove it, its brackets included" : fmt::format("give it in {}", unit));
  }
  return number(entry.value, entry.at);
}

TimeScale NdmMessage::time_scale() const {
  const NdmEntry& system = needed(metadata, "TIME_SYSTEM");
  const std::optional<TimeScale> scale = time_scale_named(system.value);
  if (!scale) {
    refuse(system.at, fmt::format("the time system {} is not known", in_quotes(system.value)),
           fmt::format("give one of {}", fmt::join(kTimeScales, ", ")));
  }
  return *scale;
}

Time NdmMessage::time(TimeText& clock, std::string_view text, Position at) const {
  TimeText::Fault fault;
  const std::optional<Time> t = clock.parse(text, fault);
  if (!t) {
    refuse(at, fault.reason, fault.cure);
  }
  return *t;
}

std::pair<std::string, std::string> NdmMessage::frames(const NdmBlock& block) const {
  const NdmEntry& a = needed(block, "REF_FRAME_A");
  const NdmEntry& b = needed(block, "REF_FRAME_B");
  std::pair<std::string, std::string> names = {normalised(a.value), normalised(b.value)};
  for (const auto& [name, entry] : {std::pair{&names.first, &a}, std::pair{&names.second, &b}}) {
    if (!is_inertial_frame(*name) && !is_spacecraft_frame(*name)) {
      refuse(entry->at,
             fmt::format("{} is neither an inertial frame nor one of the spacecraft", in_quotes(entry->value)),
             fmt::format("give one of {}; frames of the spacecraft are named {}", kInertialFrames, kSpacecraftFrames));
    }
  }
  if (is_inertial_frame(names.first) == is_inertial_frame(names.second)) {
    refuse(b.at, fmt::format("both frames are {}", is_inertial_frame(names.first) ? "inertial" : "of the spacecraft"),
           "give a frame of the spacecraft and an inertial one");
  }
  return names;
}

std::string_view ndm_kind(std::string_view text) {
  constexpr std::string_view kBegin = "CCSDS_";
  constexpr std::size_t kKindLength = 3;
  for (std::size_t i = text.find(kBegin); i != std::string_view::npos; i = text.find(kBegin, i + 1)) {
    const std::string_view rest = text.substr(i + kBegin.size());
    if (rest.size() > kKindLength && rest.substr(kKindLength).starts_with("_VERS")) {
      return rest.substr(0, kKindLength);
    }
  }
  return {};
}

}  // namespace trihedron::io
