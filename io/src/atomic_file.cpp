#include "trihedron/io/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

std::atomic<unsigned> serial = 0;  // of temporary names

constexpr std::string_view kStaged = ".trihedron-";

fs::path temporary_beside(const fs::path& target) {
  return target.parent_path() / fmt::format(".{}.{}-{}.partial", target.filename().string(), ::getpid(), serial++);
}

fs::path directory_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

/// A new name reaches the disk with its directory. Not every file system can do that, so failure is no error.
void synchronise(const fs::path& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
}

/// Removes up to `count` directories, from this one upwards, as long as they are empty.
void remove_empty(fs::path directory, int count) {
  std::error_code fault;
  directory = directory.has_filename() ? directory : directory.parent_path();
  for (; count > 0 && (fs::remove(directory, fault), !fault); --count) {
    directory = directory.parent_path();
  }
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(std::move(target)) {
  std::error_code ignored;
  const fs::file_status status = fs::status(target_, ignored);
  if (fs::is_directory(status)) {
    pending_ = false;
    throw MachineFailed(unstaged(target_), "is a directory", "give the name of a file");
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
  constexpr std::size_t kMost = std::size_t{1} << 24;
  while (!content.empty()) {
    check_stop();
    const ssize_t written = ::write(descriptor_, content.data(), std::min(content.size(), kMost));
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
  synchronise(directory_of(target_));
}

void AtomicFile::fail(int error_number) const {
  throw MachineFailed(unstaged(target_),
                      fmt::format("cannot be written: {}", std::generic_category().message(error_number)),
                      "check that the directory is there and may be written, and that the disk has room");
}

MadeDirectory::MadeDirectory(fs::path directory) : directory_(std::move(directory)) {
  std::error_code fault;
  for (fs::path above = directory_; !above.empty() && !fs::exists(above, fault); above = above.parent_path()) {
    made_ += above.has_filename() ? 1 : 0;  // not where the name ends with a slash
  }
  fs::create_directories(directory_, fault);
  // Without a fault, but also without a directory, where a file has the name.
  if (fault || !fs::is_directory(directory_, fault)) {
    remove_empty(directory_, made_);
    throw MachineFailed(directory_,
                        fmt::format("cannot be made a directory: {}", fault ? fault.message() : "a file has its name"),
                        "check the name and the rights");
  }
}

MadeDirectory::~MadeDirectory() { remove_empty(directory_, made_); }

StagedDirectory::StagedDirectory(fs::path target)
    : target_(std::move(target)),
      made_(target_),
      path_(target_ / fmt::format("{}{}-{}", kStaged, ::getpid(), serial++)) {
  std::error_code fault;
  if (!fs::create_directory(path_, fault)) {
    throw MachineFailed(target_, fmt::format("cannot be written into: {}", fault.message()), "check the rights");
  }
}

StagedDirectory::~StagedDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void StagedDirectory::commit() {
  move_from(path_, target_);
  synchronise(target_);
}

void StagedDirectory::move_from(const fs::path& staged, const fs::path& target) const {
  std::error_code fault;
  const std::vector<fs::directory_entry> entries{fs::directory_iterator(staged), fs::directory_iterator()};
  for (const fs::directory_entry& entry : entries) {
    const fs::path place = target / entry.path().filename();
    if (entry.is_directory()) {
      fs::create_directory(place, fault);
      if (!fault) {
        move_from(entry.path(), place);
      }
    } else {
      fs::rename(entry.path(), place, fault);
    }
    if (fault) {
      throw MachineFailed(place, fmt::format("cannot be written: {}", fault.message()),
                          "check that nothing else has its name");
    }
  }
}

fs::path unstaged(const fs::path& path) {
  fs::path known;
  for (const fs::path& part : path) {
    known = part.string().starts_with(kStaged) ? known : known / part;
  }
  return known;
}

void write_file(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace trihedron::io
