#include "trihedron/io/lasting_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "directories.hpp"
#include "input_file.hpp"
#include "trihedron/core/crc32.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

/// No state of a program that this one knows is larger.
constexpr std::size_t kMostOfSlots = std::size_t{1} << 26U;

[[noreturn]] void fail_to_write(const fs::path& path) {
  if (errno == EISDIR) {
    throw UsageError(fmt::format("{}: is a directory; give the name of a file", path.string()));
  }
  throw MachineFailed(path, fmt::format("cannot be written: {}", std::generic_category().message(errno)),
                      "check that the directory is there and may be written, and that the disk has room");
}

[[noreturn]] void fail_to_read(const fs::path& path) {
  throw MachineFailed(path, fmt::format("cannot be read: {}", std::generic_category().message(errno)),
                      "check the disk");
}

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// Up to the end of `bytes`, or as much as there is.
std::size_t read_into(std::span<std::byte> bytes, int file, const fs::path& path) {
  std::size_t size = 0;
  while (size < bytes.size()) {
    const ssize_t got = ::read(file, bytes.subspan(size).data(), bytes.size() - size);
    if (got == 0) {
      break;
    }
    if (got < 0 && errno != EINTR) {
      fail_to_read(path);
    }
    size += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  return size;
}

bool is_regular(int file) {
  struct stat status {};
  return ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
}

void lock_or_refuse(int file, const fs::path& path) {
  // A file system without locks serves one user all the same.
  if (::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    throw MachineFailed(path, "another program has it open", "wait until that has ended, or give another file");
  }
}

int opened_to_write(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC | O_NOCTTY, 0666);
  if (file < 0) {
    fail_to_write(path);
  }
  return file;
}

}  // namespace

GrowingFile GrowingFile::begin(const fs::path& path) {
  GrowingFile file(path, Descriptor(opened_to_write(path, O_WRONLY | O_CREAT | O_TRUNC)));
  io::synchronise(directory_of(path));
  return file;
}

GrowingFile GrowingFile::carry_on(const fs::path& path, std::uint64_t size, std::uint32_t crc) {
  expect_regular_file(path);
  std::error_code fault;
  if (!fs::exists(path, fault)) {
    throw InputRefused(path, {}, fmt::format("is not there, though {} bytes of it are confirmed", size),
                       "bring it back, or begin anew with another state");
  }
  GrowingFile file(path, Descriptor(opened_to_write(path, O_RDWR)));
  std::vector<std::byte> block(std::size_t{1} << 20U);
  while (file.size_ < size) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), size - file.size_));
    const std::size_t got = read_into(std::span(block).first(wanted), file.file_.number(), path);
    file.crc_ = crc32(std::span(block).first(got), file.crc_);
    file.size_ += got;
    if (got < wanted) {
      throw InputRefused(path, {}, fmt::format("has {} bytes, though {} are confirmed", file.size_, size),
                         "bring it back, or begin anew with another state");
    }
  }
  if (file.crc_ != crc) {
    throw InputRefused(path, {}, "is not what was confirmed", "bring that back, or begin anew with another state");
  }
  if (::ftruncate(file.file_.number(), static_cast<::off_t>(size)) != 0) {
    fail_to_write(path);
  }
  return file;
}

void GrowingFile::append(std::string_view content) {
  crc_ = crc32(bytes_of(content), crc_);
  size_ += content.size();
  while (!content.empty()) {
    const ssize_t written = ::write(file_.number(), content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      fail_to_write(path_);
    }
  }
}

void GrowingFile::synchronise() {
  // A pipe or a device cannot be synchronised, and need not be.
  if (is_regular(file_.number()) && ::fdatasync(file_.number()) != 0) {
    fail_to_write(path_);
  }
}

SlotFile SlotFile::begin(const fs::path& path, std::span<const std::byte> content) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) {
    static_cast<void>(open(path));  // refuses what is no file, and one that another program has open
  }
  write_file(path, {reinterpret_cast<const char*>(content.data()), content.size()});
  return open(path);
}

SlotFile SlotFile::open(const fs::path& path) {
  expect_regular_file(path);
  const int number = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (number < 0) {
    throw InputRefused(path, {}, fmt::format("cannot be opened: {}", std::generic_category().message(errno)),
                       "check the name and the rights");
  }
  Descriptor file(number);
  lock_or_refuse(number, path);
  struct stat status {};
  if (::fstat(number, &status) != 0) {
    fail_to_read(path);
  }
  std::vector<std::byte> content(std::min(static_cast<std::size_t>(status.st_size), kMostOfSlots));
  content.resize(read_into(content, number, path));
  return {path, std::move(file), std::move(content)};
}

void SlotFile::put(std::size_t offset, std::span<const std::byte> bytes) {
  std::ranges::copy(bytes, content_.begin() + static_cast<std::ptrdiff_t>(offset));
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(file_.number(), bytes.data(), bytes.size(), static_cast<::off_t>(offset));
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      offset += static_cast<std::size_t>(written);
    } else if (errno != EINTR) {
      fail_to_write(path_);
    }
  }
  if (::fdatasync(file_.number()) != 0) {
    fail_to_write(path_);
  }
}

}  // namespace trihedron::io
