#pragma once
/// The catalogue of the calibrations of one spacecraft: an SQLite database of version 1. Table `calibration` has a row
/// each, `parameter` its values and sigmas, `finding` the codes of its verdict; `calibration.json` is the whole of it,
/// and what is read back.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "trihedron/records/catalogue.hpp"

namespace trihedron::io {

/// Adds all or none; makes the catalogue where there is none. A calibration of the same epoch, t, estimator, drift
/// model and number of passes is replaced. A start-up without a name gets that of the epoch of the first entry. Throws
/// InputRefused for a file that is no catalogue, a damaged or newer one, or one of another spacecraft; MachineFailed
/// when it cannot be written.
void add_to_catalogue(const std::filesystem::path& file, std::span<const CatalogueEntry> entries);

/// Checks, before a long calculation, that the file is absent or a catalogue of this spacecraft. Throws InputRefused as
/// add_to_catalogue.
void expect_catalogue_of(const std::string& spacecraft, const std::filesystem::path& file);

/// In the order of epoch, and then t and number of passes. Throws as add_to_catalogue, and InputRefused where there is
/// none.
[[nodiscard]] std::vector<CatalogueEntry> read_catalogue(const std::filesystem::path& file);

}  // namespace trihedron::io
