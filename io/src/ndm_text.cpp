#include "ndm_text.hpp"

#include <algorithm>
#include <cctype>

#include "trihedron/io/error.hpp"
#include "wording.hpp"

namespace trihedron::io {

void expect_plain(std::string_view text, std::string_view what) {
  const bool plain = std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
  if (!plain || trimmed(text).empty()) {
    throw UsageError(fmt::format("{} {}: give letters, digits and marks of ASCII, as CCSDS messages hold them", what,
                                 in_quotes(text)));
  }
}

std::string escaped_for_xml(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      default:
        result.push_back(c);
    }
  }
  return result;
}

void NdmText::entry(std::string_view key, std::string_view value, std::string_view units) {
  const auto out = fmt::appender(out_);
  if (!kvn_) {
    const std::string attribute = units.empty() ? "" : fmt::format(" units=\"{}\"", units);
    fmt::format_to(out, "<{0}{1}>{2}</{0}>\n", key, attribute, escaped_for_xml(value));
  } else if (key == "COMMENT") {
    fmt::format_to(out, "COMMENT {}\n", value);
  } else {
    fmt::format_to(out, "{} = {}{}\n", key, value, units.empty() ? "" : fmt::format(" [{}]", units));
  }
}

void NdmText::header(std::string_view kind, std::string_view comment, const MessageDescription& description) {
  if (kvn_) {
    fmt::format_to(fmt::appender(out_), "CCSDS_{}_VERS = 2.0\n", kind);
  } else {
    std::string root(kind);
    std::ranges::transform(root, root.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    fmt::format_to(fmt::appender(out_),
                   "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                   "<{} xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
                   "xsi:noNamespaceSchemaLocation=\"https://sanaregistry.org/r/ndmxml_unqualified/"
                   "ndmxml-4.0.0-master-4.0.xsd\" id=\"CCSDS_{}_VERS\" version=\"2.0\">\n<header>\n",
                   root, kind);
  }
  entry("COMMENT", comment);
  entry("CREATION_DATE", description.created_utc);
  entry("ORIGINATOR", description.originator);
  put("", "</header>\n<body>\n");
}

void NdmText::end(std::string_view kind) {
  if (!kvn_) {
    fmt::format_to(fmt::appender(out_), "</body>\n</{}>\n", kind == "AEM" ? "aem" : kind == "APM" ? "apm" : "acm");
  }
}

}  // namespace trihedron::io
