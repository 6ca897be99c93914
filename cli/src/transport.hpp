#pragma once
/// Messages between the ranks of a job that mpirun has started. What carries them is a library of its own
/// (cli/mpi/transport.cpp), which is loaded in such a job alone: the program does not depend on MPI.

#include <optional>
#include <string>
#include <string_view>

namespace trihedron::cli {

/// A message, and the rank that has sent it.
struct Message {
  int from = 0;
  std::string text;
};

/// Between the ranks of a job, 0 to size() − 1. A message arrives whole, and after those that the same rank has sent
/// before.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  [[nodiscard]] virtual int rank() const = 0;
  [[nodiscard]] virtual int size() const = 0;
  virtual void send(int to, std::string_view text) = 0;
  /// Does not wait: nothing where nothing has come.
  virtual std::optional<Message> receive() = 0;
  /// Waits until all ranks have called it. Nothing may be sent after it.
  virtual void finish() = 0;
};

/// What the library holds under the name kTransportEntry: gives null to a program of another version.
using TransportEntry = Transport*(const char* version);
inline constexpr const char* kTransportEntry = "trihedron_transport";

/// Whether mpirun, or a batch system in its place, has started this process as one of a job.
[[nodiscard]] bool is_in_a_job();

/// That of this job; lives as long as the process. Throws MachineFailed where the library is not there.
[[nodiscard]] Transport& transport_of_the_job();

}  // namespace trihedron::cli
