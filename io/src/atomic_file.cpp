#include "trihedron/io/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <string>
#include <system_error>
#include <utility>

#include "directories.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

// A temporary name is `.trihedron-HOST-PID-N.partial`.
constexpr std::string_view kPartial = ".partial";

/// Of this process on this machine.
std::string own_prefix(::pid_t process) { return fmt::format("{}{}-{}-", kHidden, host_name(), process); }

/// Not longer than a name may be, however long that of the target is.
fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> serial = 0;
  return target.parent_path() / fmt::format("{}{}{}", own_prefix(::getpid()), serial++, kPartial);
}

/// The process of this machine that writes under such a name; 0 where it is no such name, or of another machine.
::pid_t writer_of(std::string_view name) {
  if (!name.starts_with(kHidden) || !name.ends_with(kPartial)) {
    return 0;
  }
  const std::size_t dash = name.rfind('-');
  const std::size_t before = dash == std::string_view::npos ? dash : name.substr(0, dash).rfind('-');
  if (before == std::string_view::npos) {
    return 0;
  }
  ::pid_t process = 0;
  std::from_chars(name.data() + before + 1, name.data() + dash, process);
  return name.starts_with(own_prefix(process)) ? process : 0;
}

/// Those of programs of this machine that run no more.
void remove_left_partials(const fs::path& directory) {
  std::error_code ignored;
  for (fs::directory_iterator entry(directory, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    const ::pid_t process = writer_of(entry->path().filename().string());
    if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH) {
      std::error_code gone;
      fs::remove(entry->path(), gone);
    }
  }
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(behind_links(std::move(target))) {
  std::error_code fault;
  const fs::file_status status = fs::status(target_, fault);
  if (status.type() == fs::file_type::none) {
    fail(fault.value());
  }
  if (fs::is_directory(status)) {
    throw UsageError(fmt::format("{}: is a directory; give the name of a file", unstaged(target_).string()));
  }
  // Renaming onto a device would replace the device.
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    temporary_ = target_;
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    remove_left_partials(directory_of(target_));
    do {
      temporary_ = temporary_beside(target_);
      descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_EXCL, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);  // left by a program that had the number of this process
  }
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

void write_file(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

void expect_writable(const fs::path& path) {
  std::error_code ignored;
  // Who reads from a pipe would take an open that writes nothing for its end.
  if (const fs::file_status status = fs::status(path, ignored);
      !fs::exists(status) || fs::is_regular_file(status) || fs::is_directory(status)) {
    const AtomicFile probe(path);
  }
}

fs::path unstaged(const fs::path& path) {
  fs::path known;
  for (const fs::path& part : path) {
    known = part.string().starts_with(kHidden) ? known : known / part;
  }
  return known;
}

}  // namespace trihedron::io
