#include "pass_toml.hpp"

#include "target.hpp"
#include "trihedron/io/error.hpp"

void trihedron::fuzz::read_pass_toml(std::string_view bytes) {
  for (const int gyros : {2, 4}) {
    try {
      PassSettings settings = io::parse_pass_toml(bytes, "pass.toml", "/dev/null", gyros);
      settings.prior.reset();
      // What was read can be written, and read again.
      static_cast<void>(io::parse_pass_toml(io::format_pass_toml(settings, ""), "again.toml", "/dev/null", gyros));
    } catch (const io::InputRefused&) {
    }
  }
  static_cast<void>(io::parse_pass_epoch(bytes, "pass.toml"));
}
