// Every table of a pass by the same reader, and what is looked for in it.
#include "csv.hpp"

#include "fixtures.hpp"
#include "pass_toml.hpp"
#include "screening.hpp"
#include "target.hpp"

void trihedron::fuzz::read_csv(std::string_view bytes) {
  static const PassSettings settings = io::parse_pass_toml(io::clean_pass().toml, "pass.toml", "/", 2);
  const MemoryFile file(bytes);
  std::vector<io::Defect> defects;
  unless_refused([&] {
    io::Series gyro = io::read_csv(file.path(), io::gyro_columns);
    expect(gyro.values.size() == gyro.rows() * gyro.columns.size(), "a value for each column");
    const std::size_t rows = gyro.rows();
    const GyroTelemetry screened = io::screen_gyro(std::move(gyro), settings, "pass.toml", defects);
    expect(screened.t.size() <= rows && std::ranges::is_sorted(screened.t), "rows in order of time");
  });
  unless_refused([&] {
    const StarTrackerTelemetry fixes =
        io::screen_star_tracker(io::read_csv(file.path(), io::star_tracker_columns), settings, "pass.toml", defects);
    expect(std::ranges::is_sorted(fixes.t), "fixes in order of time");
  });
  unless_refused([&] { static_cast<void>(io::read_csv(file.path(), io::truth_columns)); });
  for (const io::Defect& defect : defects) {
    expect(!defect.text().empty(), "words for a defect");
  }
}
