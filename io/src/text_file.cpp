#include "text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

struct Descriptor {
  int number;
  explicit Descriptor(int n) : number(n) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number >= 0) {
      ::close(number);
    }
  }
};

std::string error_text(int error_number) { return std::generic_category().message(error_number); }

}  // namespace

TextFile::TextFile(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number < 0) {
    throw InputRefused(path, {}, fmt::format("cannot be opened: {}", error_text(errno)),
                       "check the name and the rights");
  }
  struct stat status {};
  if (::fstat(file.number, &status) != 0) {
    throw MachineFailed(path, fmt::format("cannot be examined: {}", error_text(errno)), "check the disk");
  }
  if (!S_ISREG(status.st_mode)) {
    throw InputRefused(path, {}, "is not a regular file", "give the name of a file");
  }
  const auto expected = static_cast<std::size_t>(status.st_size);
  // Read, not memory-mapped: if another program truncates a mapped file, access ends this one by a signal.
  bytes_ = std::make_unique_for_overwrite<char[]>(expected + 1);
  while (size_ < expected) {
    check_stop();
    const ssize_t got = ::read(file.number, &bytes_[size_], expected - size_);
    if (got == 0) {
      break;
    }
    if (got > 0) {
      size_ += static_cast<std::size_t>(got);
    } else if (errno != EINTR) {
      throw MachineFailed(path, fmt::format("cannot be read: {}", error_text(errno)), "check the disk");
    }
  }
  bytes_[size_] = '\n';
}

}  // namespace trihedron::io
