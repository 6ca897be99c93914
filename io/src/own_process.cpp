#include "own_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <new>
#include <optional>
#include <system_error>
#include <utility>

#include "trihedron/io/descriptor.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDamagedOrTooLarge = "the file is damaged, or too large for this machine: get it again";

/// What the other process says first.
enum class Outcome : std::int64_t { kDone, kInputRefused, kMachineFailed, kOutOfMemory };

/// What the other process may take.
struct Limits {
  rlim_t cpu_s = 0;
  rlim_t data_bytes = RLIM_INFINITY;
};

/// Bytes of private data of this process; nothing where the system does not say.
std::optional<rlim_t> data_bytes_now() {
  std::array<rlim_t, 6> pages{};  // size, resident, shared, text, library, data and stack
  std::ifstream file("/proc/self/statm");
  for (rlim_t& of_kind : pages) {
    file >> of_kind;
  }
  return file ? std::optional(pages.back() * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE))) : std::nullopt;
}

/// What the size of the file explains: of processor time two seconds for the library to begin with, a hundred times
/// what it takes for a small file, and one for each megabyte; of memory a quarter of a gigabyte and sixteen times the
/// file.
Limits limits_for(const fs::path& file) {
  std::error_code ignored;
  const std::uintmax_t size = fs::file_size(file, ignored);
  const rlim_t bytes = ignored ? 0 : static_cast<rlim_t>(size);
  const std::optional<rlim_t> now = data_bytes_now();
  return {2 + (bytes >> 20), now ? *now + (rlim_t{256} << 20) + 16 * bytes : RLIM_INFINITY};
}

/// In the new process: nothing of it is seen outside, and it ends with this one.
void settle_in(const Limits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU, SIGPIPE}) {
    std::signal(signal, SIG_DFL);
  }
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit time{limits.cpu_s, limits.cpu_s};
  ::setrlimit(RLIMIT_CPU, &time);
  const rlimit data{limits.data_bytes, limits.data_bytes};
  ::setrlimit(RLIMIT_DATA, &data);
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  ::dup2(nowhere, STDERR_FILENO);  // where the C library reports a damaged heap
}

Sink sink_for(Outcome outcome, int descriptor) { return {descriptor, static_cast<std::int64_t>(outcome)}; }

void do_work(int descriptor, const std::function<void(Sink&)>& work) {
  Sink result = sink_for(Outcome::kDone, descriptor);
  try {
    work(result);
  } catch (...) {
    if (result.has_begun()) {
      throw;
    }
    try {
      throw;
    } catch (const InputRefused& refused) {
      Sink sink = sink_for(Outcome::kInputRefused, descriptor);
      sink.put(refused.file().string());
      sink.put(refused.position().line);
      sink.put(refused.position().column);
      sink.put(refused.reason());
      sink.put(refused.cure());
    } catch (const MachineFailed& failed) {
      Sink sink = sink_for(Outcome::kMachineFailed, descriptor);
      sink.put(failed.file().string());
      sink.put(failed.reason());
      sink.put(failed.cure());
    } catch (const std::bad_alloc&) {
      Sink sink = sink_for(Outcome::kOutOfMemory, descriptor);
      sink.put(std::int64_t{0});
    }
  }
}

void take_outcome(Source& source, const fs::path& file, const std::function<void(Source&)>& take) {
  switch (static_cast<Outcome>(source.number())) {
    case Outcome::kDone:
      take(source);
      return;
    case Outcome::kInputRefused: {
      fs::path place = source.text();
      const Position position{source.number(), source.number()};
      std::string reason = source.text();
      throw InputRefused(std::move(place), position, std::move(reason), source.text());
    }
    case Outcome::kMachineFailed: {
      fs::path place = source.text();
      std::string reason = source.text();
      throw MachineFailed(std::move(place), std::move(reason), source.text());
    }
    case Outcome::kOutOfMemory:
      throw InputRefused(file, {}, "takes more memory than its size explains, or than there is", kDamagedOrTooLarge);
  }
  throw PipeEnded();
}

/// A process that is ended, and waited for, at the latest with this object.
class Child {
 public:
  explicit Child(pid_t id) : id_(id) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (id_ > 0) {
      ::kill(id_, SIGKILL);
      static_cast<void>(status());
    }
  }
  /// As waitpid() gives it.
  int status() {
    int status = 0;
    while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    return status;
  }

 private:
  pid_t id_;
};

[[noreturn]] void refuse_by(int status, const fs::path& file, rlim_t cpu_s) {
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    throw InputRefused(file, {},
                       fmt::format("keeps the NetCDF library busy for more than {} s, or takes all memory", cpu_s),
                       kDamagedOrTooLarge);
  }
  throw InputRefused(file, {}, "is damaged in a way that the NetCDF library does not survive", "get it again");
}

}  // namespace

void Sink::write(const void* data, std::size_t size) const {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(descriptor_, at, size);
    if (written < 0 && errno != EINTR) {
      ::_exit(EXIT_FAILURE);  // nobody listens
    }
    at += std::max<ssize_t>(written, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(written, 0));
  }
}

void Sink::put(std::int64_t number) {
  if (!std::exchange(has_begun_, true)) {
    write(&outcome_, sizeof outcome_);
  }
  write(&number, sizeof number);
}

void Sink::put(std::string_view text) {
  put(static_cast<std::int64_t>(text.size()));
  write(text.data(), text.size());
}

void Sink::put(const std::vector<double>& values) {
  put(static_cast<std::int64_t>(values.size()));
  write(values.data(), values.size() * sizeof(double));
}

void Source::read(void* data, std::size_t size) {
  constexpr int kPatience_ms = 100;  // until it looks whether it has been asked to stop
  char* at = static_cast<char*>(data);
  while (size > 0) {
    check_stop();
    pollfd ready{descriptor_, POLLIN, 0};
    if (::poll(&ready, 1, kPatience_ms) <= 0) {
      continue;
    }
    const ssize_t got = ::read(descriptor_, at, size);
    if (got == 0) {
      throw PipeEnded();
    }
    at += std::max<ssize_t>(got, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
}

std::int64_t Source::number() {
  std::int64_t number = 0;
  read(&number, sizeof number);
  return number;
}

template <class Container>
Container Source::sequence() {
  constexpr std::int64_t kPiece = 1 << 21;  // no more memory than what has come explains
  Container values;
  for (std::int64_t rest = number(); rest > 0;) {
    const std::int64_t piece = std::min(rest, std::max(kPiece, static_cast<std::int64_t>(values.size())));
    const std::size_t before = values.size();
    values.resize(before + static_cast<std::size_t>(piece));
    read(values.data() + before, static_cast<std::size_t>(piece) * sizeof(typename Container::value_type));
    rest -= piece;
  }
  return values;
}

std::string Source::text() { return sequence<std::string>(); }
std::vector<double> Source::numbers() { return sequence<std::vector<double>>(); }

void in_own_process(const fs::path& file, const std::function<void(Sink&)>& work,
                    const std::function<void(Source&)>& take) {
  const Limits limits = limits_for(file);
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw MachineFailed(file, "cannot be read: no pipe is left", "close some programs");
  }
  constexpr int kPipeBytes = 1 << 20;
  ::fcntl(ends[1], F_SETPIPE_SZ, kPipeBytes);  // fewer changes from one process to the other; where it fails, more
  const Descriptor read_end(ends[0]);
  Descriptor write_end(ends[1]);
  const pid_t id = ::fork();
  if (id < 0) {
    throw MachineFailed(file, "cannot be read: no process is left", "close some programs");
  }
  if (id == 0) {
    settle_in(limits);
    try {
      do_work(ends[1], work);
      ::_exit(EXIT_SUCCESS);
    } catch (...) {
      ::_exit(EXIT_FAILURE);
    }
  }
  Child child(id);
  write_end.close();
  try {
    Source source(read_end.number());
    take_outcome(source, file, take);
  } catch (const PipeEnded&) {
    check_stop();  // the same signal may have ended the other
    refuse_by(child.status(), file, limits.cpu_s);
  }
}

}  // namespace trihedron::io
