#include "trihedron/io/staged_directory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>

#include "directories.hpp"
#include "text_file.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

// Hidden names in the directory.
constexpr const char* kLock = ".trihedron-lock";
constexpr const char* kNew = ".trihedron-new";        // the set that is being written
constexpr const char* kSaving = ".trihedron-saving";  // the next one, while it is made and when it is needed no more
constexpr const char* kUndo = ".trihedron-undo";      // as long as it is there, the set is to be taken back
// Names in kUndo: the files that were there before, and empty files with the names of those that were not.
constexpr const char* kReplaced = "replaced";
constexpr const char* kAdded = "added";

[[noreturn]] void fail_to_place(const fs::path& place, const std::string& reason) {
  throw MachineFailed(unstaged(place), fmt::format("cannot be written: {}", reason),
                      "check the rights, that nothing else has its name, and that the disk has room");
}

/// Calls `work` and turns the faults of the file system into MachineFailed.
template <class Work>
void placing(const fs::path& target, const Work& work) {
  try {
    work();
  } catch (const fs::filesystem_error& error) {
    fail_to_place(error.path1().empty() ? target : error.path1(), error.code().message());
  }
}

/// All files below a directory, none where there is no such directory, by their names relative to it.
std::vector<fs::path> files_below(const fs::path& root) {
  std::vector<fs::path> files;
  if (fs::exists(root)) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
      if (!entry.is_directory()) {
        files.push_back(entry.path().lexically_relative(root));
      }
    }
  }
  return files;
}

void copy_onto(const fs::path& from, const fs::path& to) {
  write_file(to, TextFile(from).text());
  fs::permissions(to, fs::status(from).permissions());
}

/// Follows links at `place`. Over one to another file system, where nothing can be moved, the content is copied.
void move_onto(const fs::path& from, const fs::path& place) {
  const fs::path target = behind_links(place);
  std::error_code fault;
  fs::rename(from, target, fault);
  if (fault == std::errc::cross_device_link) {
    copy_onto(from, target);
    fs::remove(from);
  } else if (fault) {
    throw fs::filesystem_error("rename", place, fault);
  }
}

/// A second name for a file, or a copy where the file system knows none.
void save(const fs::path& file, const fs::path& as) {
  std::error_code fault;
  fs::create_directories(as.parent_path());
  fs::create_hard_link(file, as, fault);
  if (fault) {
    copy_onto(file, as);
  }
}

/// Throws where a file of this relative name could not have its place.
void expect_place(const fs::path& target, const fs::path& name) {
  fs::path place = target;
  for (const fs::path& part : name.parent_path()) {
    place /= part;
    if (fs::exists(place) && !fs::is_directory(place)) {
      fail_to_place(place, "a file has its name");
    }
  }
  place = target / name;
  if (fs::is_directory(place)) {
    fail_to_place(place, "a directory has its name");
  }
  if (fs::exists(place) && !fs::is_regular_file(place)) {
    fail_to_place(place, "what has its name is no regular file");
  }
}

void remove_with_empty_directories(const fs::path& target, const fs::path& name) {
  fs::remove(behind_links(target / name));
  remove_empty((target / name).parent_path(),
               static_cast<int>(std::distance(name.begin(), name.end())) - 1);  // `target` itself stays
}

/// Brings back what the set that is in place, whole or in part, has replaced. Where that is interrupted it can be done
/// again.
void take_back(const fs::path& target) {
  const fs::path undo = target / kUndo;
  for (const fs::path& name : files_below(undo / kAdded)) {
    remove_with_empty_directories(target, name);
  }
  for (const fs::path& name : files_below(undo / kReplaced)) {
    move_onto(undo / kReplaced / name, target / name);
  }
  synchronise(target);
  fs::remove_all(target / kSaving);
  fs::rename(undo, target / kSaving);
}

/// Leaves the old set alone, or the new one where that was kept; nobody else may write.
void clear_up(const fs::path& target) {
  if (fs::exists(target / kUndo)) {
    take_back(target);
  }
  fs::remove_all(target / kSaving);
  fs::remove_all(target / kNew);
}

/// Where it cannot, the next one that stages files here tries again.
void clear_up_if_it_can(const fs::path& target) noexcept {
  const StopScope to_the_end(nullptr);
  try {
    clear_up(target);
  } catch (const std::exception&) {
    return;
  }
}

/// The one that wrote its name into the lock.
std::string holder_in(int descriptor) {
  std::array<char, 300> text{};
  const ssize_t size = ::pread(descriptor, text.data(), text.size(), 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "another process";
}

bool is_still(const fs::path& file, int descriptor) {
  struct stat of_name {};
  struct stat of_descriptor {};
  return ::stat(file.c_str(), &of_name) == 0 && ::fstat(descriptor, &of_descriptor) == 0 &&
         of_name.st_ino == of_descriptor.st_ino && of_name.st_dev == of_descriptor.st_dev;
}

}  // namespace

MadeDirectory::MadeDirectory(fs::path directory) : directory_(std::move(directory)) {
  std::error_code fault;
  if (fs::exists(directory_, fault) && !fs::is_directory(directory_, fault)) {
    throw UsageError(fmt::format("{}: is a file; give the name of a directory", directory_.string()));
  }
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

DirectoryLock::DirectoryLock(const fs::path& directory) : file_(directory / kLock) {
  do {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0) {
      throw MachineFailed(unstaged(directory),
                          fmt::format("cannot be written into: {}", std::generic_category().message(errno)),
                          "check the rights and that the disk has room, or give another directory");
    }
    // A file system without locks serves one user all the same.
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      const std::string holder = holder_in(descriptor_);
      ::close(descriptor_);
      throw MachineFailed(unstaged(directory), fmt::format("{} is writing into it", holder),
                          "wait until that has ended, or give another directory");
    }
  } while (!is_still(file_, descriptor_));  // whoever had it may have removed it meanwhile
  const std::string text = fmt::format("process {} on {}", ::getpid(), host_name());
  if (::ftruncate(descriptor_, 0) == 0) {
    // A full disk is found by those who write more.
    [[maybe_unused]] const ssize_t written = ::pwrite(descriptor_, text.data(), text.size(), 0);
  }
}

DirectoryLock::~DirectoryLock() {
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

StagedDirectory::StagedDirectory(fs::path target)
    : target_(std::move(target)), made_(target_), lock_(target_), path_(target_ / kNew) {
  placing(target_, [&] {
    clear_up(target_);
    fs::create_directory(path_);
  });
}

StagedDirectory::~StagedDirectory() { clear_up_if_it_can(target_); }

void StagedDirectory::expect_places(std::span<const fs::path> names) const {
  placing(target_, [&] {
    for (const fs::path& name : names) {
      expect_place(target_, name);
    }
  });
}

void StagedDirectory::put_in_place() {
  placing(target_, [&] {
    const std::vector<fs::path> files = files_below(path_);
    std::vector<fs::path> touched = files;
    touched.insert(touched.end(), dropped_.begin(), dropped_.end());
    for (const fs::path& name : touched) {
      expect_place(target_, name);
    }
    const fs::path saving = target_ / kSaving;
    fs::create_directory(saving);
    for (const fs::path& name : touched) {
      if (const fs::path old = behind_links(target_ / name); fs::exists(old)) {
        save(old, saving / kReplaced / name);
        if (fs::exists(path_ / name)) {
          fs::permissions(path_ / name, fs::status(old).permissions());
        }
      } else {
        fs::create_directories((saving / kAdded / name).parent_path());
        write_file(saving / kAdded / name, "");
      }
    }
    synchronise(saving);
    fs::rename(saving, target_ / kUndo);
    synchronise(target_);
    for (const fs::path& name : files) {
      fs::create_directories((target_ / name).parent_path());
      move_onto(path_ / name, target_ / name);
    }
    for (const fs::path& name : dropped_) {
      fs::remove(behind_links(target_ / name));
    }
    synchronise(target_);
  });
}

void StagedDirectory::keep() {
  placing(target_, [&] { fs::rename(target_ / kUndo, target_ / kSaving); });
  synchronise(target_);
  clear_up_if_it_can(target_);
}

void StagedDirectory::commit() {
  put_in_place();
  keep();
}

}  // namespace trihedron::io
