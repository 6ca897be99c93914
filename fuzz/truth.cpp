#include "truth.hpp"

#include "csv.hpp"
#include "fixtures.hpp"
#include "target.hpp"

void trihedron::fuzz::read_truth(std::string_view bytes) {
  // The parameters, and the table behind a NUL, as the seeds have them.
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  const MemoryFile table(bytes.substr(std::min(end + 1, bytes.size())));
  const Truth truth =
      io::make_truth(bytes.substr(0, end), "truth.json", io::read_csv(table.path(), io::truth_columns), Time{});
  expect(!truth.gyros.empty() && truth.q_in_c.size() == truth.t.size(), "an attitude for each time");
  static_cast<void>(io::format_truth_parameters(truth));
}
