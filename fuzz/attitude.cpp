#include "trihedron/io/attitude.hpp"

#include "target.hpp"

void trihedron::fuzz::read_attitude(std::string_view bytes) {
  const MemoryFile file(bytes);
  const AttitudeHistory attitude = io::read_attitude(file.path(), Time{});
  expect(attitude.size() > 0 && attitude.q_in_c.size() == attitude.size(), "an attitude for each time");
}
