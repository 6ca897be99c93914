#include "input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

const char* kind_of(mode_t mode) {
  switch (mode & S_IFMT) {
    case S_IFDIR:
      return "a directory";
    case S_IFIFO:
      return "a FIFO";
    case S_IFSOCK:
      return "a socket";
    default:
      return "a device";
  }
}

void expect_regular(const std::filesystem::path& path, const struct stat& status) {
  if (!S_ISREG(status.st_mode)) {
    throw InputRefused(path, {}, fmt::format("is {}, not a regular file", kind_of(status.st_mode)),
                       "give the name of a file");
  }
}

std::string error_text() { return std::generic_category().message(errno); }

int opened(const std::filesystem::path& path) {
  expect_regular_file(path);  // before, because opening a device can already do something
  // O_NONBLOCK: opening a FIFO would wait for somebody who writes.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0) {
    throw InputRefused(path, {}, fmt::format("cannot be opened: {}", error_text()), "check the name and the rights");
  }
  return descriptor;
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : InputFile(opened(path)) {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) {
    throw MachineFailed(path, fmt::format("cannot be examined: {}", error_text()), "check the disk");
  }
  expect_regular(path, status);  // the name may have changed hands
  size_ = static_cast<std::size_t>(status.st_size);
}

InputFile::~InputFile() { ::close(descriptor_); }

void expect_regular_file(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    expect_regular(path, status);
  }
}

}  // namespace trihedron::io
