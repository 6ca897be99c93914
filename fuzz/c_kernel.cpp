#include "ck_reader.hpp"
#include "target.hpp"

/// The text of the clock, a zero, and the pointing.
void trihedron::fuzz::read_c_kernel(std::string_view bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  const std::string_view pointing = bytes.substr(std::min(end + 1, bytes.size()));
  const io::AttitudeMessage message = io::parse_c_kernel(pointing, "a.bc", bytes.substr(0, end), "a.tsc");
  expect(!message.attitude.t.empty() && message.attitude.q_in_c.size() == message.attitude.size(),
         "an attitude for each time");
  expect(message.rate_rad_s.empty() || message.rate_rad_s.size() == message.attitude.size(),
         "a rate for each time, or none");
  for (std::size_t i = 1; i < message.attitude.size(); ++i) {
    expect(message.attitude.t[i - 1] < message.attitude.t[i], "times that increase");
  }
}
