#include "document.hpp"

#include "assets.hpp"
#include "html.hpp"

namespace trihedron::report {

std::string html_of(const Document& document, nlohmann::json values) {
  values["content"] = fill_in(document.content, values);
  values["title"] = document.title;
  values["kind"] = document.kind;
  values["first_section"] = document.first_section;
  values["reading_notes"] = document.reading_notes;
  values["style"] = assets::kStyle;
  values["plotly"] = assets::kPlotly;
  values["script"] = document.script;
  values["data"] = script_safe(document.figures);
  values["version"] = TRIHEDRON_VERSION;
  return fill_in(assets::kDocument, values);
}

}  // namespace trihedron::report
