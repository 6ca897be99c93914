#pragma once
/// The report of a catalogue: how the parameters changed over the calibrations and the starts of the rotors.

#include <string>
#include <vector>

#include "trihedron/ground/calibrate/history.hpp"
#include "trihedron/records/catalogue.hpp"

namespace trihedron::report {

/// One HTML text that holds everything it shows and opens offline, UTF-8. `history`: of this catalogue.
[[nodiscard]] std::string render_history(const std::vector<CatalogueEntry>& catalogue, const ground::History& history);

}  // namespace trihedron::report
