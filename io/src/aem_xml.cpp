#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <pugixml.hpp>
#include <vector>

#include "aem_builder.hpp"
#include "aem_syntax.hpp"
#include "ndm_places.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::array<std::string_view, 9> kQuaternionTags = {"EPOCH",  "Q1",     "Q2",     "Q3",    "QC",
                                                             "Q1_DOT", "Q2_DOT", "Q3_DOT", "QC_DOT"};
constexpr std::array<std::string_view, 8> kAngularVelocityTags = {"EPOCH", "Q1",       "Q2",       "Q3",
                                                                  "QC",    "ANGVEL_X", "ANGVEL_Y", "ANGVEL_Z"};

/// One AEM as XML.
class Xml {
 public:
  Xml(std::string_view text, const std::filesystem::path& file) : places_(text), file_(file), size_(text.size()) {
    const pugi::xml_parse_result parsed =
        document_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (parsed.status == pugi::status_out_of_memory) {
      throw std::bad_alloc();
    }
    if (!parsed) {
      throw InputRefused(file_, places_.of(parsed.offset), fmt::format("is no whole XML: {}", parsed.description()),
                         "write the file again, as a whole");
    }
  }

  AttitudeMessage read() {
    const pugi::xml_node aem = root();
    if (std::string_view(aem.attribute("id").value()) != "CCSDS_AEM_VERS") {
      refuse(aem, "its root has no id=\"CCSDS_AEM_VERS\"", "add it, and the version");
    }
    AemBuilder builder(file_, {aem.attribute("version").value(), at(aem)}, "XML");
    const pugi::xml_node header = only(aem, "header", "body");
    for (const pugi::xml_node& entry : header.children()) {
      take(builder, entry, &AemBuilder::header);
    }
    const pugi::xml_node body = header.next_sibling();
    for (const pugi::xml_node& segment : body.children()) {
      expect(segment, "segment");
      read_segment(builder, segment);
    }
    return builder.finish(places_.of(static_cast<std::ptrdiff_t>(size_)));
  }

 private:
  using Taker = void (AemBuilder::*)(AemField, AemField);

  [[nodiscard]] Position at(const pugi::xml_node& node) const { return places_.of(node.offset_debug()); }

  [[noreturn]] void refuse(const pugi::xml_node& node, std::string reason, std::string cure) const {
    throw InputRefused(file_, at(node), std::move(reason), std::move(cure));
  }

  void expect(const pugi::xml_node& node, std::string_view name) const {
    if (!is_ndm_element(node) || ndm_name(node) != name) {
      refuse(node, fmt::format("{} where <{}> should stand", in_quotes(node.name()), name),
             "give an AEM of the standard's structure");
    }
  }

  /// The first of two children, which are all that a node has.
  [[nodiscard]] pugi::xml_node only(const pugi::xml_node& node, std::string_view first, std::string_view second) const {
    const pugi::xml_node child = node.first_child();
    const pugi::xml_node next = child.next_sibling();
    if (ndm_name(child) != first || ndm_name(next) != second || !next.next_sibling().empty()) {
      refuse(node, fmt::format("<{}> does not consist of <{}> and <{}>", node.name(), first, second),
             "give an AEM of the standard's structure");
    }
    return child;
  }

  /// The message, which may stand alone within <ndm>.
  [[nodiscard]] pugi::xml_node root() const {
    pugi::xml_node node = document_.document_element();
    if (ndm_name(node) == "ndm") {
      pugi::xml_node aem;
      for (const pugi::xml_node& child : node.children()) {
        if (ndm_name(child) == "aem") {
          if (!aem.empty()) {
            refuse(child, "there are several AEM in it", "give each a file of its own");
          }
          aem = child;
        }
      }
      node = aem.empty() ? node : aem;
    }
    if (ndm_name(node) != "aem") {
      refuse(node, fmt::format("its root is {}", in_quotes(node.name())), "give an attitude ephemeris message, <aem>");
    }
    return node;
  }

  [[nodiscard]] AemField text_of(const pugi::xml_node& node) const {
    const pugi::xml_node text = node.first_child();
    if (!text.next_sibling().empty() ||
        (!text.empty() && text.type() != pugi::node_pcdata && text.type() != pugi::node_cdata)) {
      refuse(node, fmt::format("<{}> holds more than a text", node.name()), "give it a value alone");
    }
    std::string_view words = text.value();
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (!words.empty() && blank(words.front())) {
      words.remove_prefix(1);
    }
    while (!words.empty() && blank(words.back())) {
      words.remove_suffix(1);
    }
    return {words, at(node)};
  }

  void take(AemBuilder& builder, const pugi::xml_node& entry, Taker taker) const {
    if (ndm_name(entry) == "COMMENT") {
      builder.comment(text_of(entry).text);
    } else {
      (builder.*taker)({ndm_name(entry), at(entry)}, text_of(entry));
    }
  }

  void read_segment(AemBuilder& builder, const pugi::xml_node& segment) const {
    const pugi::xml_node metadata = only(segment, "metadata", "data");
    builder.begin_segment(at(metadata));
    for (const pugi::xml_node& entry : metadata.children()) {
      take(builder, entry, &AemBuilder::metadata);
    }
    builder.end_metadata(at(metadata));
    const pugi::xml_node data = metadata.next_sibling();
    for (const pugi::xml_node& child : data.children()) {
      if (ndm_name(child) != "COMMENT") {
        expect(child, "attitudeState");
        read_state(builder, child);
      }
    }
    builder.end_segment(at(data));
  }

  void read_state(AemBuilder& builder, const pugi::xml_node& state) const {
    const pugi::xml_node type = state.first_child();
    if (!type.next_sibling().empty() || !ndm_name(type).starts_with("quaternion")) {
      refuse(state, "<attitudeState> does not hold one quaternion",
             "give quaternionEphemeris, quaternionDerivative or quaternionAngVel, as ATTITUDE_TYPE says");
    }
    const std::span<const std::string_view> tags = builder.kind() == AemBuilder::Kind::kAngularVelocity
                                                       ? std::span<const std::string_view>(kAngularVelocityTags)
                                                       : std::span<const std::string_view>(kQuaternionTags);
    // Rates of version 1 are those of Euler angles, and are not used.
    const bool rates_ignored = builder.kind() == AemBuilder::Kind::kEulerRate;
    const std::size_t count = rates_ignored ? 5 : columns_of(builder.kind());
    std::array<AemField, kQuaternionTags.size()> fields;
    std::array<bool, kQuaternionTags.size()> there{};
    const auto take_leaf = [&](const pugi::xml_node& leaf) {
      const auto found = std::ranges::find(tags.first(count), ndm_name(leaf));
      const auto index = static_cast<std::size_t>(found - tags.begin());
      if (index == count) {
        if (rates_ignored && ndm_name(leaf).ends_with("_RATE")) {
          return;
        }
        refuse(leaf, fmt::format("<{}> is no part of this ATTITUDE_TYPE", leaf.name()),
               "correct the type, or remove it");
      }
      if (there.at(index)) {
        refuse(leaf, fmt::format("<{}> is there twice", leaf.name()), "keep one");
      }
      expect_units(leaf, index);
      there.at(index) = true;
      fields.at(index) = text_of(leaf);
    };
    for (const pugi::xml_node& child : type.children()) {
      const std::string_view name = ndm_name(child);
      if (name == "quaternion" || name == "quaternionDot" || name == "quaternionRate" || name == "angVel" ||
          name == "rotationRates") {
        for (const pugi::xml_node& leaf : child.children()) {
          take_leaf(leaf);
        }
      } else {
        take_leaf(child);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!there.at(i)) {
        refuse(type, fmt::format("<{}> has no <{}>", type.name(), tags[i]), "add it");
      }
    }
    fields[0].at = at(type);
    builder.row({fields.data(), count});
  }

  /// Where units are told they must be those of the standard.
  void expect_units(const pugi::xml_node& leaf, std::size_t index) const {
    const pugi::xml_attribute units = leaf.attribute("units");
    const std::string_view name = ndm_name(leaf);
    const std::string_view expected = index < 5 ? "" : name.ends_with("_DOT") ? "1/s" : "deg/s";
    if (!units.empty() && units.value() != expected) {
      refuse(leaf, fmt::format("the unit of <{}> is {}", leaf.name(), in_quotes(units.value())),
             expected.empty() ? "it has none" : fmt::format("give it in {}", expected));
    }
  }

  pugi::xml_document document_;
  NdmPlaces places_;
  const std::filesystem::path& file_;
  std::size_t size_;
};

}  // namespace

AttitudeMessage parse_aem_xml(std::string_view text, const std::filesystem::path& file) {
  return Xml(text, file).read();
}

}  // namespace trihedron::io
