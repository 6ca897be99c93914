#include "trihedron/io/calibration.hpp"

#include "target.hpp"

void trihedron::fuzz::read_calibration(std::string_view bytes) {
  const Calibration calibration = io::parse_calibration(bytes, "calibration.json");
  // What was read can be written, and read again.
  static_cast<void>(io::parse_calibration(io::format_calibration(calibration), "again.json"));
}
