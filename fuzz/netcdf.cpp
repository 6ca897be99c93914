// A NetCDF file of any bytes. HDF5 takes the checksums as they stand, as they would be in a file that was made to harm.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>

#include "target.hpp"
#include "trihedron/io/pass.hpp"

/// In place of the library's own: what it is compared with stands behind the block.
extern "C" std::uint32_t H5_checksum_metadata(const void* data, std::size_t size, std::uint32_t /*initial*/) {
  std::uint32_t stored = 0;
  std::memcpy(&stored, static_cast<const char*>(data) + size, sizeof stored);
  return stored;
}

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  // A library that crashes in the process made for it is no crash of the reader.
  return ::pthread_atfork(nullptr, nullptr, [] {
    __sanitizer_set_death_callback([] { ::_exit(1); });
    ::close(STDERR_FILENO);
  });
}

void trihedron::fuzz::read(std::string_view bytes) {
  const MemoryFile file(bytes);
  static_cast<void>(io::read_pass(file.path()));
  static_cast<void>(io::read_truth(file.path()));
}
