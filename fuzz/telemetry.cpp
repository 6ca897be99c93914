// A telemetry.toml, and after a zero byte the table of its gyros.
#include "fixtures.hpp"
#include "target.hpp"
#include "telemetry_map.hpp"
#include "telemetry_table.hpp"

void trihedron::fuzz::read_telemetry(std::string_view bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  const io::TelemetryToml told = io::parse_telemetry_toml(bytes.substr(0, end), "telemetry.toml", "/dev/null");
  const io::GyroMap& map = told.map.gyro;
  expect(map.units.size() >= 2, "gyros");
  std::vector<std::string> columns;
  for (const std::string& name : map.units.front().columns) {
    columns.push_back(name.starts_with('-') ? name.substr(1) : name);
  }
  const std::string_view table = bytes.substr(std::min(end + 1, bytes.size()));
  const io::ForeignTable read = io::parse_foreign_csv(table, "table.csv", map, {map.time_column}, columns);
  for (const auto& column : read.numbers) {
    expect(column.size() == read.rows(), "a value for each stamp");
  }
}
