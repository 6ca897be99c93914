#include "trihedron/io/attitude_message.hpp"

#include "target.hpp"

void trihedron::fuzz::read_attitude_message(std::string_view bytes) {
  const io::AttitudeMessage message = io::parse_attitude_message(bytes, "attitude.aem");
  expect(!message.attitude.t.empty() && message.attitude.q_in_c.size() == message.attitude.size(),
         "an attitude for each time");
  expect(message.rate_rad_s.empty() || message.rate_rad_s.size() == message.attitude.size(),
         "a rate for each time, or none");
  for (std::size_t i = 1; i < message.attitude.size(); ++i) {
    expect(message.attitude.t[i - 1] < message.attitude.t[i], "times that increase");
  }
}
