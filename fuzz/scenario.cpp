#include "trihedron/io/scenario.hpp"

#include "target.hpp"

void trihedron::fuzz::read_scenario(std::string_view bytes) {
  const Scenario scenario = io::parse_scenario(bytes, "/dev/null/scenario.toml");
  expect(!scenario.gyros.empty(), "gyros");
}
