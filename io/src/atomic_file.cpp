#include "trihedron/io/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> serial = 0;
  return target.parent_path() / fmt::format(".{}.{}-{}.partial", target.filename().string(), ::getpid(), serial++);
}

fs::path directory_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(std::move(target)) {
  std::error_code ignored;
  const fs::file_status status = fs::status(target_, ignored);
  if (fs::is_directory(status)) {
    pending_ = false;
    throw MachineFailed(target_, "is a directory", "give the name of a file");
  }
  // Renaming onto a device would replace the device.
  temporary_ = fs::exists(status) && !fs::is_regular_file(status) ? target_ : temporary_beside(target_);
  const int flags = O_WRONLY | O_CLOEXEC | (straight() ? 0 : O_CREAT | O_EXCL);
  descriptor_ = ::open(temporary_.c_str(), flags, 0666);
  if (descriptor_ < 0) {
    fail(errno);
  }
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      pending_(std::exchange(other.pending_, false)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
  if (pending_ && !straight()) {
    ::unlink(temporary_.c_str());
  }
}

void AtomicFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      fail(errno);
    }
  }
}

void AtomicFile::commit() {
  // A pipe or a device cannot be synchronised, and need not be.
  if (!straight() && ::fsync(descriptor_) != 0) {
    fail(errno);
  }
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    fail(errno);
  }
  if (!straight() && ::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail(errno);
  }
  pending_ = false;
  // The new name itself reaches the disk with its directory. Not every file system can do that, so failure is no error.
  const int directory = ::open(directory_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory >= 0) {
    ::fsync(directory);
    ::close(directory);
  }
}

void AtomicFile::fail(int error_number) const {
  throw MachineFailed(target_, fmt::format("cannot be written: {}", std::generic_category().message(error_number)),
                      "check that the directory is there and may be written, and that the disk has room");
}

bool make_directory(const fs::path& directory) {
  std::error_code fault;
  const bool made = fs::create_directories(directory, fault);
  // Without a fault, but also without a directory, where a file has the name.
  if (fault || !fs::is_directory(directory, fault)) {
    throw MachineFailed(directory,
                        fmt::format("cannot be made a directory: {}", fault ? fault.message() : "a file has its name"),
                        "check the name and the rights");
  }
  return made;
}

void write_file(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace trihedron::io
