#include "trihedron/io/residuals.hpp"

#include <stdexcept>

#include "netcdf_file.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io {

void write_residuals(const std::filesystem::path& path, Time epoch, std::span<const Table> tables) {
  NetcdfWriter file(path);
  file.write_attribute("", "Conventions", "CF-1.8");
  file.write_attribute("", "format", "trihedron-residuals");
  file.write_attribute("", "version", "1");
  file.write_attribute("", "title", "Residuals of a gyro calibration");
  file.write_attribute("", "epoch_tai", format_epoch(epoch));
  for (const Table& table : tables) {
    std::vector<PackedColumn> columns;
    for (const Column& column : table.columns) {
      if (column.values.size() != table.t.size()) {
        throw std::invalid_argument("column " + column.name + " is not as long as its table");
      }
      columns.push_back({column});
    }
    file.write_group(table.group, epoch, table.t, columns);
  }
  file.commit();
}

}  // namespace trihedron::io
