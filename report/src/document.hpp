#pragma once
/// The frame of every page: head, masthead, footer, scripts.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace trihedron::report {

struct Document {
  std::string_view title;          ///< of the window, before the spacecraft
  std::string_view kind;           ///< over the spacecraft
  std::string_view first_section;  ///< its id and name
  std::string_view reading_notes;
  std::string_view content;  ///< template of navigation and sections
  std::string script;
  nlohmann::json figures;
};

/// HTML. `values`: for the content, "spacecraft" and "facts" of the masthead among them.
[[nodiscard]] std::string html_of(const Document& document, nlohmann::json values);

}  // namespace trihedron::report
