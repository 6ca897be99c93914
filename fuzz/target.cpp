#include "target.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "trihedron/io/error.hpp"

namespace trihedron::fuzz {
namespace {

struct Target {
  std::string_view name;
  void (*read)(std::string_view bytes);
};
constexpr std::array<Target, 16> kTargets = {{{"attitude", read_attitude},
                                              {"attitude_message", read_attitude_message},
                                              {"c_kernel", read_c_kernel},
                                              {"calibration", read_calibration},
                                              {"catalogue", read_catalogue},
                                              {"catalogue_sql", read_catalogue_sql},
                                              {"csv", read_csv},
                                              {"netcdf", read_netcdf},
                                              {"netcdf_layout", read_netcdf_layout},
                                              {"orbit_message", read_orbit_message},
                                              {"packets", read_packets},
                                              {"pass_toml", read_pass_toml},
                                              {"scenario", read_scenario},
                                              {"settings", read_settings},
                                              {"telemetry", read_telemetry},
                                              {"truth", read_truth}}};
const Target* target = nullptr;  ///< that the program is called by

/// Of all inputs; libFuzzer itself counts whole seconds.
class WorstTime {
 public:
  WorstTime() = default;
  WorstTime(const WorstTime&) = delete;
  WorstTime& operator=(const WorstTime&) = delete;
  ~WorstTime() { fmt::print(stderr, "stat::worst_time_ms: {:.1f}\n", longest_.count()); }

  template <class Work>
  void measure(const Work& work) {
    const auto begun = std::chrono::steady_clock::now();
    work();
    longest_ = std::max<Milliseconds>(longest_, std::chrono::steady_clock::now() - begun);
  }

 private:
  using Milliseconds = std::chrono::duration<double, std::milli>;
  Milliseconds longest_{};
};

}  // namespace

MemoryFile::MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("input", MFD_CLOEXEC)) {
  expect(::write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
         "memory for the input");
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

std::filesystem::path MemoryFile::path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

DirectoryFile::DirectoryFile(std::string_view bytes) {
  std::string name = "/dev/shm/trihedron-fuzz-XXXXXX";
  expect(::mkdtemp(name.data()) != nullptr, "a directory for the input");
  directory_ = name;
  std::ofstream(path(), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

DirectoryFile::~DirectoryFile() {
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

void expect(bool condition, const char* what) {
  if (!condition) {
    fmt::print(stderr, "not as expected: {}\n", what);
    std::abort();
  }
}

}  // namespace trihedron::fuzz

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** argv) {
  using namespace trihedron::fuzz;
  const std::string program = std::filesystem::path((*argv)[0]).filename();
  target = std::ranges::find(kTargets, program, [](const Target& its) { return fmt::format("fuzz_{}", its.name); });
  expect(target != kTargets.end(), "a program of the name of a target");
  // A library that crashes in the process made for it is no crash of the reader.
  return ::pthread_atfork(nullptr, nullptr, [] {
    __sanitizer_set_death_callback([] { ::_exit(1); });
    ::close(STDERR_FILENO);
  });
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static trihedron::fuzz::WorstTime worst_time;
  worst_time.measure([&] {
    try {
      trihedron::fuzz::target->read({reinterpret_cast<const char*>(data), size});
    } catch (const trihedron::io::InputRefused& refused) {
      const std::string_view message = refused.what();
      trihedron::fuzz::expect(!refused.reason().empty() && !refused.cure().empty(), "a reason and a cure");
      trihedron::fuzz::expect(message.find('\n') == std::string_view::npos, "a message of one line");
    }
  });
  return 0;
}
