#include "trihedron/report/report.hpp"

#include "assets.hpp"
#include "figures.hpp"
#include "html.hpp"
#include "parameters.hpp"
#include "tables.hpp"
#include "verdict.hpp"

namespace trihedron::report {

std::string render(const ReportInput& input) {
  const std::vector<Parameter> parameters = parameters_of(input);
  const nlohmann::json figures = figure_data(input, parameters);
  nlohmann::json values = table_values(input, parameters);
  values.update(verdict_values(input, parameters));
  for (const auto& [name, data] : figures.items()) {
    values["draws_" + name] = true;
  }
  values["style"] = assets::kStyle;
  values["plotly"] = assets::kPlotly;
  values["script"] = std::string(assets::kFigures) + std::string(assets::kSphere) + std::string(assets::kReport);
  values["data"] = script_safe(figures);
  values["version"] = TRIHEDRON_VERSION;
  return fill_in(assets::kPage, values);
}

}  // namespace trihedron::report
