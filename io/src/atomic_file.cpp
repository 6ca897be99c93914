#include "trihedron/io/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <system_error>
#include <utility>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

std::atomic<unsigned> serial = 0;  // of temporary names

// Hidden names: `.trihedron-PID-N` is a directory with a set that is being written, `.trihedron-complete` one that only
// has to be put in place, `.trihedron-HOST-PID-N.partial` a file that is being written.
constexpr std::string_view kHidden = ".trihedron-";
constexpr std::string_view kComplete = ".trihedron-complete";
constexpr std::string_view kPartial = ".partial";

fs::path directory_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

std::string host() {
  std::array<char, 65> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

/// The process in a name that starts with `before`; 0 where there is none.
::pid_t process_in(std::string_view name, std::string_view before) {
  ::pid_t process = 0;
  if (name.starts_with(before)) {
    name.remove_prefix(before.size());
    std::from_chars(name.data(), name.data() + name.size(), process);
  }
  return process;
}

/// Those of programs of this machine that run no more.
void remove_left_partials(const fs::path& directory) {
  const std::string before = fmt::format("{}{}-", kHidden, host());
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored)) {
    const std::string name = entry.path().filename().string();
    const ::pid_t process = name.ends_with(kPartial) ? process_in(name, before) : 0;
    if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH) {
      fs::remove(entry.path(), ignored);
    }
  }
}

/// Not longer than a name may be, however long that of the target is.
fs::path temporary_beside(const fs::path& target) {
  return target.parent_path() / fmt::format("{}{}-{}-{}{}", kHidden, host(), ::getpid(), serial++, kPartial);
}

/// What a chain of symbolic links leads to, which need not be there.
fs::path behind_links(fs::path file) {
  constexpr int kMostLinks = 40;  // as Linux has it
  std::error_code fault;
  for (int link = 0; link < kMostLinks && fs::is_symlink(fs::symlink_status(file, fault)); ++link) {
    file = directory_of(file) / fs::read_symlink(file, fault);
  }
  return file;
}

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

AtomicFile::AtomicFile(fs::path target) : target_(behind_links(std::move(target))) {
  std::error_code ignored;
  remove_left_partials(directory_of(target_));
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
  if (fs::is_regular_file(status)) {
    ::fchmod(descriptor_, static_cast<::mode_t>(status.permissions()));
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

DirectoryLock::DirectoryLock(const fs::path& directory)
    : descriptor_(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  // A file system without locks serves one user all the same.
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) {
    return;
  }
  ::close(descriptor_);
  std::string holder;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored)) {
    const ::pid_t process = process_in(entry.path().filename().string(), kHidden);
    holder = process > 0 ? fmt::format(", number {},", process) : holder;
  }
  throw MachineFailed(unstaged(directory), fmt::format("another process{} is writing into it", holder),
                      "wait until that has ended, or give another directory");
}

DirectoryLock::~DirectoryLock() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

namespace {

[[noreturn]] void fail_to_place(const fs::path& place, const std::string& reason) {
  throw MachineFailed(unstaged(place), fmt::format("cannot be written: {}", reason),
                      "check that nothing else has its name");
}

/// Calls `place_file(staged, place)` for each file of a set, and `place_directory(place)` for each directory before it.
template <class PlaceFile, class PlaceDirectory>
void for_each_place(const fs::path& staged, const fs::path& target, const PlaceFile& place_file,
                    const PlaceDirectory& place_directory) {
  const std::vector<fs::directory_entry> entries{fs::directory_iterator(staged), fs::directory_iterator()};
  for (const fs::directory_entry& entry : entries) {
    const fs::path place = target / entry.path().filename();
    if (entry.is_directory()) {
      place_directory(place);
      for_each_place(entry.path(), place, place_file, place_directory);
    } else {
      place_file(entry.path(), place);
    }
  }
}

/// Whether every file of a set can have its place, found out before the first has it.
void expect_places_free(const fs::path& staged, const fs::path& target) {
  for_each_place(
      staged, target,
      [](const fs::path&, const fs::path& place) {
        if (fs::is_directory(place)) {
          fail_to_place(place, "a directory has its name");
        }
      },
      [](const fs::path& place) {
        if (fs::exists(place) && !fs::is_directory(place)) {
          fail_to_place(place, "a file has its name");
        }
      });
}

/// Moves a set to its places; what has been moved before is no more in it.
void put_in_place(const fs::path& staged, const fs::path& target) {
  std::error_code fault;
  const auto check = [&](const fs::path& place) {
    if (fault) {
      fail_to_place(place, fault.message());
    }
  };
  for_each_place(
      staged, target,
      [&](const fs::path& file, const fs::path& place) {
        const fs::path behind = behind_links(place);
        if (const fs::file_status status = fs::status(behind, fault); fs::is_regular_file(status)) {
          fs::permissions(file, status.permissions(), fault);
        }
        fs::rename(file, behind, fault);
        if (fault == std::errc::cross_device_link) {
          const fs::path near = temporary_beside(behind);
          fs::copy_file(file, near, fault);
          check(place);
          fs::rename(near, behind, fault);
        }
        check(place);
      },
      [&](const fs::path& place) {
        fs::create_directory(place, fault);
        check(place);
      });
  synchronise(target);
  fs::remove_all(staged, fault);
}

/// Finishes what killed programs left in a directory that nobody else writes into: complete sets get their places,
/// others go.
void clear_up(const fs::path& target) {
  if (fs::exists(target / kComplete)) {
    put_in_place(target / kComplete, target);
  }
  const std::vector<fs::directory_entry> entries{fs::directory_iterator(target), fs::directory_iterator()};
  for (const fs::directory_entry& entry : entries) {
    std::error_code ignored;
    if (process_in(entry.path().filename().string(), kHidden) > 0 && entry.is_directory(ignored)) {
      fs::remove_all(entry.path(), ignored);
    }
  }
  remove_left_partials(target);
}

}  // namespace

StagedDirectory::StagedDirectory(fs::path target)
    : target_(std::move(target)),
      made_(target_),
      lock_(target_),
      path_(target_ / fmt::format("{}{}-{}", kHidden, ::getpid(), serial++)) {
  std::error_code fault;
  try {
    clear_up(target_);
    fs::create_directory(path_, fault);
  } catch (const fs::filesystem_error& error) {
    fault = error.code();
  }
  if (fault) {
    throw MachineFailed(unstaged(target_), fmt::format("cannot be written into: {}", fault.message()),
                        "check the rights");
  }
}

StagedDirectory::~StagedDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void StagedDirectory::commit() {
  try {
    expect_places_free(path_, target_);
    fs::rename(path_, target_ / kComplete);
    synchronise(target_);
    put_in_place(target_ / kComplete, target_);
  } catch (const fs::filesystem_error& error) {
    fail_to_place(target_, error.code().message());
  }
}

fs::path unstaged(const fs::path& path) {
  fs::path known;
  for (const fs::path& part : path) {
    known = part.string().starts_with(kHidden) ? known : known / part;
  }
  return known;
}

void write_file(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace trihedron::io
