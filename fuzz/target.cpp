#include "target.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "trihedron/io/error.hpp"

namespace trihedron::fuzz {
namespace {

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

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static trihedron::fuzz::WorstTime worst_time;
  worst_time.measure([&] {
    try {
      trihedron::fuzz::read({reinterpret_cast<const char*>(data), size});
    } catch (const trihedron::io::InputRefused& refused) {
      const std::string_view message = refused.what();
      trihedron::fuzz::expect(!refused.reason().empty() && !refused.cure().empty(), "a reason and a cure");
      trihedron::fuzz::expect(message.find('\n') == std::string_view::npos, "a message of one line");
    }
  });
  return 0;
}
