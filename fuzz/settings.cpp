#include "target.hpp"
#include "trihedron/io/config.hpp"

void trihedron::fuzz::read_settings(std::string_view bytes) {
  const MemoryFile file(bytes);
  const CalibrationOptions options = io::read_config(file.path());
  // What was read can be written, and read again.
  const MemoryFile again(io::format_config(options));
  static_cast<void>(io::read_config(again.path()));
}
