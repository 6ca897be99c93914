#include "trihedron/report/report.hpp"

#include <utility>

#include "assets.hpp"
#include "document.hpp"
#include "figures.hpp"
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
  return html_of(
      {.title = "Gyro calibration",
       .kind = "Gyro calibration report",
       .first_section = "verdict",
       .reading_notes = "Time runs in minutes from the start of the pass. Sigmas are one standard deviation. An "
                        "error is the estimate less what it is compared with. Lines are "
                        "thinned for drawing so that the least and greatest value of every moment are kept; nothing is "
                        "skipped.",
       .content = assets::kPage,
       .script = std::string(assets::kFigures) + std::string(assets::kSphere) + std::string(assets::kReport),
       .figures = figures},
      std::move(values));
}

}  // namespace trihedron::report
