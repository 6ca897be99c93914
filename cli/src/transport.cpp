#include "transport.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "trihedron/io/error.hpp"
#include "worker_processes.hpp"

namespace trihedron::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLibrary = "trihedron-mpi.so";

/// Beside the program, as it is built, or where it is installed. Throws MachineFailed.
fs::path library() {
  std::error_code fault;
  const fs::path program = fs::read_symlink(kThisProgram, fault);
  if (fault) {
    throw io::MachineFailed(
        kThisProgram,
        fmt::format("cannot be read ({}); {} is looked for beside the program", fault.message(), kLibrary),
        "mount /proc, or start the campaign without mpirun");
  }
  const fs::path beside = program.parent_path() / kLibrary;
  return fs::exists(beside, fault) ? beside : program.parent_path() / TRIHEDRON_LIBRARIES / kLibrary;
}

}  // namespace

// By PMIx, which Open MPI's mpirun and Slurm's srun speak.
bool is_in_a_job() { return std::getenv("PMIX_RANK") != nullptr; }  // NOLINT(concurrency-mt-unsafe): nothing sets it

Transport& transport_of_the_job() {
  const fs::path file = library();
  const auto missing = [&](const std::string& why) {
    return io::MachineFailed(file, fmt::format("cannot be loaded ({}), and carries what the ranks of a job tell", why),
                             "install trihedron-mpi; or, from sources, install libopenmpi-dev and build again, which "
                             "puts it beside the program; or start the campaign without mpirun");
  };
  // The parts of Open MPI that it loads by itself look for their functions among all that are loaded.
  void* const handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (handle == nullptr) {
    throw missing(::dlerror());
  }
  void* const entry = ::dlsym(handle, kTransportEntry);
  Transport* const transport = entry == nullptr ? nullptr : reinterpret_cast<TransportEntry*>(entry)(TRIHEDRON_VERSION);
  if (transport == nullptr) {
    throw missing("it is of another version");
  }
  return *transport;
}

}  // namespace trihedron::cli
