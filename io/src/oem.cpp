#include "oem.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <new>
#include <optional>
#include <pugixml.hpp>
#include <span>
#include <utility>

#include "ccsds_frames.hpp"
#include "ndm_message.hpp"
#include "ndm_places.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_scale.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/limits.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace oem {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 4> kHeader = {"CLASSIFICATION", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID"};
constexpr std::array<std::string_view, 12> kMetadata = {
    "OBJECT_NAME", "OBJECT_ID",          "CENTER_NAME",       "REF_FRAME", "REF_FRAME_EPOCH", "TIME_SYSTEM",
    "START_TIME",  "USEABLE_START_TIME", "USEABLE_STOP_TIME", "STOP_TIME", "INTERPOLATION",   "INTERPOLATION_DEGREE"};
constexpr std::array<std::string_view, 10> kState = {"EPOCH", "X",     "Y",      "Z",      "X_DOT",
                                                     "Y_DOT", "Z_DOT", "X_DDOT", "Y_DDOT", "Z_DDOT"};
constexpr std::size_t kUsed = 7;  // accelerations are read over

struct Word {
  std::string text;
  Position at;
};
using Entries = std::map<std::string, Word, std::less<>>;
struct State {
  std::array<Word, kUsed> fields;
};
struct RawSegment {
  Position at;
  Entries metadata;
  std::vector<State> states;
};

/// A message as it is written, in either syntax.
struct RawMessage {
  fs::path file;
  std::string_view syntax;
  Word version;
  Entries header;
  std::vector<RawSegment> segments;
  Position end;

  [[noreturn]] void refuse(Position at, std::string reason, std::string cure) const {
    throw InputRefused(file, at, std::move(reason), std::move(cure));
  }

  void add(Entries& entries, std::span<const std::string_view> known, std::string_view section, const Word& key,
           const Word& value) const {
    if (std::ranges::find(known, key.text) == known.end()) {
      refuse(key.at, fmt::format("{} is no keyword of the {} of an OEM", in_quotes(key.text), section),
             suggestion(key.text, known));
    }
    if (value.text.empty()) {
      refuse(key.at, fmt::format("{} has no value", key.text), "give one, or remove the line");
    }
    if (!entries.try_emplace(key.text, value).second) {
      refuse(key.at, fmt::format("{} is there twice", key.text), "keep one");
    }
  }
  [[nodiscard]] const Word& needed(const Entries& entries, std::string_view key, Position at) const {
    const auto found = entries.find(key);
    if (found == entries.end()) {
      refuse(at, fmt::format("{} is missing", key), "add it: an OEM must have it");
    }
    return found->second;
  }
};

// ---- KVN

class OemKvn {
 public:
  OemKvn(std::string_view text, RawMessage& message) : lines_(text), message_(message) {}

  void read() {
    begin();
    std::optional<std::string_view> line;
    while ((line = lines_.next())) {
      const std::string_view words = trimmed(*line);
      if (words == "META_START") {
        read_metadata(message_.segments.emplace_back());
      } else if (words == "COVARIANCE_START" && !message_.segments.empty()) {
        skip_covariance();
      } else if (is_comment(words)) {
        continue;
      } else if (message_.segments.empty()) {
        assign(message_.header, kHeader, "header", words);
      } else {
        read_state(message_.segments.back(), words);
      }
    }
    message_.end = lines_.here();
  }

 private:
  static bool is_comment(std::string_view words) {
    constexpr std::string_view kComment = "COMMENT";
    return words == kComment || (words.starts_with(kComment) && words[kComment.size()] == ' ');
  }
  [[nodiscard]] Word word(std::string_view text) const { return {std::string(text), lines_.at(text)}; }

  void begin() {
    const std::optional<std::string_view> line = lines_.next();
    const std::string_view words = line ? trimmed(*line) : std::string_view{};
    const std::size_t equals = words.find('=');
    if (equals == std::string_view::npos || trimmed(words.substr(0, equals)) != "CCSDS_OEM_VERS") {
      message_.refuse(lines_.at(words), "does not begin with CCSDS_OEM_VERS", "give an orbit ephemeris message (OEM)");
    }
    message_.version = word(trimmed(words.substr(equals + 1)));
  }

  void assign(Entries& entries, std::span<const std::string_view> known, std::string_view section,
              std::string_view words) {
    const std::size_t equals = words.find('=');
    if (equals == std::string_view::npos) {
      message_.refuse(lines_.at(words), fmt::format("{} is no assignment", in_quotes(words)), "write KEYWORD = value");
    }
    const std::string_view value = trimmed(words.substr(equals + 1));
    message_.add(entries, known, section, word(trimmed(words.substr(0, equals))), word(value));
  }

  void read_metadata(RawSegment& segment) {
    segment.at = lines_.here();
    while (const std::optional<std::string_view> line = lines_.next()) {
      const std::string_view words = trimmed(*line);
      if (words == "META_STOP") {
        return;
      }
      if (!is_comment(words)) {
        assign(segment.metadata, kMetadata, "metadata", words);
      }
    }
    message_.refuse(lines_.here(), "the file ends within metadata", "write the file again, as a whole");
  }

  void skip_covariance() {
    while (const std::optional<std::string_view> line = lines_.next()) {
      if (trimmed(*line) == "COVARIANCE_STOP") {
        return;
      }
    }
    message_.refuse(lines_.here(), "the file ends within a covariance, without COVARIANCE_STOP",
                    "write the file again, as a whole");
  }

  void read_state(RawSegment& segment, std::string_view words) {
    State state;
    std::size_t count = 0;
    for (std::size_t begin = 0; begin < words.size(); ++count) {
      const std::size_t end = std::min(words.find_first_of(" \t", begin), words.size());
      if (count < kUsed) {
        state.fields.at(count) = word(words.substr(begin, end - begin));
      }
      begin = std::min(words.find_first_not_of(" \t", end), words.size());
    }
    if (count != kUsed && count != kState.size()) {
      message_.refuse(lines_.at(words), fmt::format("the line has {} value{}", count, count == 1 ? "" : "s"),
                      "an epoch, position and velocity stand in a line, and an acceleration if any: 7 or 10 values");
    }
    segment.states.push_back(std::move(state));
  }

  NdmLines lines_;
  RawMessage& message_;
};

// ---- XML

class OemXml {
 public:
  OemXml(std::string_view text, RawMessage& message) : places_(text), message_(message), size_(text.size()) {
    const pugi::xml_parse_result parsed =
        document_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (parsed.status == pugi::status_out_of_memory) {
      throw std::bad_alloc();
    }
    if (!parsed) {
      message_.refuse(places_.of(parsed.offset), fmt::format("is no whole XML: {}", parsed.description()),
                      "write the file again, as a whole");
    }
  }

  void read() {
    pugi::xml_node oem = document_.document_element();
    if (ndm_name(oem) == "ndm") {
      const pugi::xml_node child = oem.first_child();
      oem = child.next_sibling().empty() ? child : oem;
    }
    if (ndm_name(oem) != "oem" || std::string_view(oem.attribute("id").value()) != "CCSDS_OEM_VERS") {
      message_.refuse(at(oem), fmt::format("its root is {}", in_quotes(oem.name())),
                      "give an orbit ephemeris message, <oem id=\"CCSDS_OEM_VERS\">, one in a file");
    }
    message_.version = {oem.attribute("version").value(), at(oem)};
    const auto [header, body] = pair_of(oem, "header", "body");
    take_all(header, message_.header, kHeader, "header");
    for (const pugi::xml_node& node : body.children()) {
      if (ndm_name(node) != "segment") {
        refuse_structure(node, "<segment>");
      }
      const auto [metadata, data] = pair_of(node, "metadata", "data");
      RawSegment& segment = message_.segments.emplace_back();
      segment.at = at(metadata);
      take_all(metadata, segment.metadata, kMetadata, "metadata");
      for (const pugi::xml_node& child : data.children()) {
        if (ndm_name(child) == "stateVector") {
          segment.states.push_back(state_of(child));
        } else if (ndm_name(child) != "COMMENT" && ndm_name(child) != "covarianceMatrix") {
          refuse_structure(child, "<stateVector>");
        }
      }
    }
    message_.end = places_.of(static_cast<std::ptrdiff_t>(size_));
  }

 private:
  [[nodiscard]] Position at(const pugi::xml_node& node) const { return places_.of(node.offset_debug()); }

  [[noreturn]] void refuse_structure(const pugi::xml_node& node, std::string_view expected) const {
    message_.refuse(at(node), fmt::format("{} where {} should stand", in_quotes(node.name()), expected),
                    "give an OEM of the standard's structure");
  }

  [[nodiscard]] std::pair<pugi::xml_node, pugi::xml_node> pair_of(const pugi::xml_node& node, std::string_view first,
                                                                  std::string_view second) const {
    const pugi::xml_node child = node.first_child();
    const pugi::xml_node next = child.next_sibling();
    if (ndm_name(child) != first || ndm_name(next) != second || !next.next_sibling().empty()) {
      message_.refuse(at(node), fmt::format("<{}> does not consist of <{}> and <{}>", node.name(), first, second),
                      "give an OEM of the standard's structure");
    }
    return {child, next};
  }

  [[nodiscard]] Word text_of(const pugi::xml_node& node) const {
    const pugi::xml_node text = node.first_child();
    if (!is_ndm_element(node) || !text.next_sibling().empty() ||
        (!text.empty() && text.type() != pugi::node_pcdata && text.type() != pugi::node_cdata)) {
      message_.refuse(at(node), fmt::format("{} holds more than a text", in_quotes(node.name())),
                      "give it a value alone");
    }
    const std::string_view value = text.value();
    const std::size_t begin = std::min(value.find_first_not_of(" \t\r\n"), value.size());
    return {std::string(value.substr(begin, value.find_last_not_of(" \t\r\n") + 1 - begin)), at(node)};
  }

  void take_all(const pugi::xml_node& node, Entries& entries, std::span<const std::string_view> known,
                std::string_view section) const {
    for (const pugi::xml_node& child : node.children()) {
      check_stop();
      if (ndm_name(child) != "COMMENT") {
        message_.add(entries, known, section, {std::string(ndm_name(child)), at(child)}, text_of(child));
      }
    }
  }

  [[nodiscard]] State state_of(const pugi::xml_node& node) const {
    check_stop();
    State state;
    std::array<bool, kState.size()> there{};
    for (const pugi::xml_node& leaf : node.children()) {
      const auto index = static_cast<std::size_t>(std::ranges::find(kState, ndm_name(leaf)) - kState.begin());
      if (index == kState.size() || there.at(index)) {
        message_.refuse(at(leaf),
                        index == kState.size() ? fmt::format("<{}> is no part of a state", leaf.name())
                                               : fmt::format("<{}> is there twice", leaf.name()),
                        "keep one each of EPOCH, X, Y, Z, X_DOT, Y_DOT, Z_DOT");
      }
      there.at(index) = true;
      const std::string_view units = leaf.attribute("units").value();
      const std::string_view expected = index == 0 ? "" : index < 4 ? "km" : index < kUsed ? "km/s" : "km/s**2";
      if (!units.empty() && units != expected) {
        message_.refuse(at(leaf), fmt::format("the unit of <{}> is {}", leaf.name(), in_quotes(units)),
                        expected.empty() ? "it has none" : fmt::format("give it in {}", expected));
      }
      if (index < kUsed) {
        state.fields.at(index) = text_of(leaf);
      }
    }
    for (std::size_t i = 0; i < kUsed; ++i) {
      if (!there.at(i)) {
        message_.refuse(at(node), fmt::format("<{}> has no <{}>", node.name(), kState.at(i)), "add it");
      }
    }
    return state;
  }

  pugi::xml_document document_;
  NdmPlaces places_;
  RawMessage& message_;
  std::size_t size_;
};

// ---- What it says

class Meaning {
 public:
  Meaning(const RawMessage& raw, Time epoch) : raw_(raw), epoch_(epoch) {}

  [[nodiscard]] OrbitMessage message() {
    constexpr std::array<std::string_view, 3> kVersions = {"1.0", "2.0", "3.0"};
    if (std::ranges::find(kVersions, raw_.version.text) == kVersions.end()) {
      raw_.refuse(raw_.version.at, fmt::format("version {} of the OEM is not known", in_quotes(raw_.version.text)),
                  "give a message of version 1.0, 2.0 or 3.0");
    }
    const Word& created = raw_.needed(raw_.header, "CREATION_DATE", raw_.version.at);
    std::string_view date = created.text;
    date.remove_suffix(date.ends_with('Z') ? 1 : 0);
    TimeText::Fault fault;
    // By its form only: it may be later than the last leap second that is known.
    if (!TimeText(TimeScale::kTai).parse(date, fault)) {
      raw_.refuse(created.at, "CREATION_DATE: " + fault.reason, fault.cure);
    }
    static_cast<void>(raw_.needed(raw_.header, "ORIGINATOR", raw_.version.at));
    message_.format = fmt::format("CCSDS OEM version {}, {}", raw_.version.text.front(), raw_.syntax);
    for (const RawSegment& segment : raw_.segments) {
      take(segment);
    }
    if (raw_.segments.empty()) {
      raw_.refuse(raw_.end, "the message has no segment", "give a message with data");
    }
    return std::move(message_);
  }

 private:
  /// The same in all segments.
  void take_once(std::string& target, std::string value, const Word& word, std::string_view key) const {
    if (!message_.segments.empty() && target != value) {
      raw_.refuse(word.at,
                  fmt::format("{} is {}, that of the segment before {}", key, in_quotes(value), in_quotes(target)),
                  "give each a message of its own");
    }
    target = std::move(value);
  }

  [[nodiscard]] double seconds(const Word& word) {
    TimeText::Fault fault;
    const std::optional<Time> t = clock_.parse(word.text, fault);
    if (!t) {
      raw_.refuse(word.at, fault.reason, fault.cure);
    }
    return to_seconds(*t - epoch_);
  }

  [[nodiscard]] double number(const Word& word) const {
    double value = 0;
    std::string_view digits = word.text;
    digits.remove_prefix(digits.starts_with('+') && !digits.starts_with("+-") ? 1 : 0);
    const auto [end, fault] = fast_float::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (fault != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
      raw_.refuse(word.at, fmt::format("{} is not a number", in_quotes(word.text)), "repair the line");
    }
    return value;
  }

  void take_frame(const RawSegment& segment) {
    const Word& centre = raw_.needed(segment.metadata, "CENTER_NAME", segment.at);
    if (normalised(centre.text) != "EARTH") {
      raw_.refuse(centre.at, fmt::format("CENTER_NAME is {}", in_quotes(centre.text)),
                  "give the orbit about the EARTH");
    }
    const Word& frame = raw_.needed(segment.metadata, "REF_FRAME", segment.at);
    const std::string name = normalised(frame.text);
    if (!is_inertial_frame(name)) {
      raw_.refuse(frame.at, fmt::format("REF_FRAME {} is not one of {}", in_quotes(frame.text), kInertialFrames),
                  "turn the orbit into one of these before: nothing is turned here");
    }
    take_once(message_.inertial_frame, name, frame, "REF_FRAME");
  }

  void take_interpolation(const RawSegment& segment, EphemerisSegment& its) const {
    using Method = EphemerisSegment::Interpolation;
    const auto method = segment.metadata.find("INTERPOLATION");
    const auto degree = segment.metadata.find("INTERPOLATION_DEGREE");
    if (method == segment.metadata.end()) {
      return;  // as EphemerisSegment has it; Orekit writes a degree also where no method is told
    }
    const std::string name = normalised(method->second.text);
    if (name != "HERMITE" && name != "LAGRANGE" && name != "LINEAR") {
      raw_.refuse(method->second.at, fmt::format("the interpolation {} is not known", in_quotes(method->second.text)),
                  "give HERMITE, LAGRANGE or LINEAR");
    }
    its.interpolation = name == "HERMITE" ? Method::kHermite : Method::kLagrange;
    if (degree == segment.metadata.end()) {
      if (name != "LINEAR") {
        raw_.refuse(method->second.at, "INTERPOLATION is there without INTERPOLATION_DEGREE", "add it");
      }
      its.degree = 1;
      return;
    }
    const double value = number(degree->second);
    if (value != std::floor(value) || !limits::kInterpolationDegree.holds(value) || (name == "LINEAR" && value != 1)) {
      raw_.refuse(degree->second.at, fmt::format("INTERPOLATION_DEGREE is {}", in_quotes(degree->second.text)),
                  name == "LINEAR"
                      ? "it is 1"
                      : fmt::format("give a whole number from {:g} to {:g}", limits::kInterpolationDegree.least,
                                    limits::kInterpolationDegree.most));
    }
    its.degree = static_cast<int>(value);
  }

  void take(const RawSegment& segment) {
    const auto entry = [&](std::string_view key) -> const Word& {
      return raw_.needed(segment.metadata, key, segment.at);
    };
    take_once(message_.object_name, entry("OBJECT_NAME").text, entry("OBJECT_NAME"), "OBJECT_NAME");
    static_cast<void>(entry("OBJECT_ID"));
    take_frame(segment);
    const Word& system = entry("TIME_SYSTEM");
    const std::optional<TimeScale> scale = time_scale_named(system.text);
    if (!scale) {
      raw_.refuse(system.at, fmt::format("the time system {} is not known", in_quotes(system.text)),
                  fmt::format("give one of {}", fmt::join(kTimeScales, ", ")));
    }
    take_once(message_.time_system, name_of(*scale), system, "TIME_SYSTEM");
    if (*scale != clock_.scale()) {
      clock_ = TimeText(*scale);
    }
    EphemerisSegment its;
    const double start_s = seconds(entry("START_TIME"));
    const double stop_s = seconds(entry("STOP_TIME"));
    const bool begins = segment.metadata.contains("USEABLE_START_TIME");
    const bool ends = segment.metadata.contains("USEABLE_STOP_TIME");
    its.begin_s = begins ? seconds(entry("USEABLE_START_TIME")) : start_s;
    its.end_s = ends ? seconds(entry("USEABLE_STOP_TIME")) : stop_s;
    if (stop_s < start_s) {
      raw_.refuse(entry("STOP_TIME").at, "STOP_TIME is before START_TIME", "correct them");
    }
    if (its.begin_s < start_s || its.end_s > stop_s || its.end_s < its.begin_s) {
      raw_.refuse(entry(begins ? "USEABLE_START_TIME" : "USEABLE_STOP_TIME").at,
                  "the useable span does not lie within START_TIME and STOP_TIME", "correct them");
    }
    if (!message_.segments.empty() && its.begin_s < message_.segments.back().end_s) {
      raw_.refuse(entry(begins ? "USEABLE_START_TIME" : "START_TIME").at,
                  "the segment begins within the useable span of the one before",
                  "let USEABLE_START_TIME of a segment follow USEABLE_STOP_TIME of the one before");
    }
    take_interpolation(segment, its);
    for (const State& state : segment.states) {
      take_state(state, start_s, stop_s, its);
    }
    if (its.t_s.size() < its.nodes()) {
      raw_.refuse(segment.at,
                  fmt::format("the segment has {} states, and interpolation of degree {} needs {}", its.t_s.size(),
                              its.degree, its.nodes()),
                  "add states, or give a lower INTERPOLATION_DEGREE");
    }
    if (its.t_s.front() > its.begin_s || its.t_s.back() < its.end_s) {
      raw_.refuse(segment.at, "the states do not reach to both ends of the useable span",
                  "add states, or correct USEABLE_START_TIME and USEABLE_STOP_TIME");
    }
    message_.segments.push_back(std::move(its));
  }

  void take_state(const State& state, double start_s, double stop_s, EphemerisSegment& its) {
    constexpr double kKilometre = 1e3;
    check_stop();
    const Word& epoch = state.fields[0];
    const double t_s = seconds(epoch);
    if (!its.t_s.empty() && t_s <= its.t_s.back()) {
      raw_.refuse(epoch.at, fmt::format("the epoch {} is not later than the one before", in_quotes(epoch.text)),
                  "put the states in order, each epoch once");
    }
    if (t_s < start_s || t_s > stop_s) {
      raw_.refuse(epoch.at, fmt::format("the epoch {} lies outside START_TIME and STOP_TIME", in_quotes(epoch.text)),
                  "correct these, or remove the state");
    }
    Eigen::Vector3d position_m;
    Eigen::Vector3d velocity_m_s;
    for (std::size_t i = 0; i < 3; ++i) {
      position_m(static_cast<Eigen::Index>(i)) = kKilometre * number(state.fields.at(1 + i));
      velocity_m_s(static_cast<Eigen::Index>(i)) = kKilometre * number(state.fields.at(4 + i));
    }
    for (const auto& [value, range, place, what] :
         {std::tuple{position_m.norm(), limits::kOrbitRadius_m, 1, "the distance from the Earth's centre"},
          std::tuple{velocity_m_s.norm(), limits::kOrbitSpeed_m_s, 4, "the speed"}}) {
      if (!range.holds(value)) {
        raw_.refuse(state.fields.at(static_cast<std::size_t>(place)).at,
                    fmt::format("{} is {:g} {}: {}", what, value / kKilometre, place == 1 ? "km" : "km/s", range.why),
                    "give kilometres and kilometres per second");
      }
    }
    its.t_s.push_back(t_s);
    its.position_m.push_back(position_m);
    its.velocity_m_s.push_back(velocity_m_s);
  }

  const RawMessage& raw_;
  Time epoch_;
  TimeText clock_{TimeScale::kTai};
  OrbitMessage message_;
};

}  // namespace
}  // namespace oem

bool is_orbit_message(std::string_view text) { return ndm_kind(text) == "OEM"; }

OrbitMessage parse_orbit_message(std::string_view text, const std::filesystem::path& file, Time epoch) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  const bool is_xml = text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size())).starts_with('<');
  oem::RawMessage raw;
  raw.file = file;
  raw.syntax = is_xml ? "XML" : "KVN";
  if (is_xml) {
    oem::OemXml(text, raw).read();
  } else {
    oem::OemKvn(text, raw).read();
  }
  return oem::Meaning(raw, epoch).message();
}

}  // namespace trihedron::io
