#pragma once
/// Columns against time in a CF NetCDF-4 file, a group per table: residuals and whatever else is worth plotting.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::io {

/// One variable of a table.
struct Column {
  std::string name;   ///< of the variable; NetCDF allows letters, digits and _
  std::string units;  ///< UDUNITS: "1", "rad", "arcsec"
  std::string long_name;
  std::vector<double> values;  ///< one per time; NaN where there is none
};

/// One group of the file: columns over common times.
struct Table {
  std::string group;
  std::vector<Time> t;
  std::vector<Column> columns;
};

/// Those of a calibration: what each fix left and what was done with it, the estimates along the pass, and the residual
/// of the angle between the momenta.
[[nodiscard]] std::vector<Table> residual_tables(const CalibrationRun& run);

/// `xarray.open_dataset(path, group=...)` reads each table. Columns must be as long as their `t`
/// (std::invalid_argument). Throws MachineFailed when the file cannot be written; then nothing stays.
void write_residuals(const std::filesystem::path& path, Time epoch, std::span<const Table> tables);

}  // namespace trihedron::io
