#include "worker_processes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::cli {
namespace {

constexpr const char* kCloseSome = "close some programs";

io::MachineFailed not_started(const std::string& why, const char* cure) {
  return {kThisProgram, fmt::format("cannot be started to perform runs: {}", why), cure};
}

/// Processes one after another that were killed before their first line: then the next would be as well.
constexpr int kMostKilledAtStart = 3;

std::string text_of_error(int error) { return std::generic_category().message(error); }

/// As waitpid() gives it.
int status_of(pid_t id) {
  int status = 0;
  while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

std::string how_it_ended(int status) {
  return WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                             : fmt::format("exit status {}", WEXITSTATUS(status));
}

}  // namespace

WorkerProcesses::WorkerProcesses(std::string campaign_file, std::size_t count)
    : campaign_file_(std::move(campaign_file)), processes_(count) {
  for (Process& process : processes_) {
    process = start();
  }
}

WorkerProcesses::~WorkerProcesses() {
  for (Process& process : processes_) {
    if (process.id > 0) {
      ::kill(process.id, SIGKILL);  // nothing that it has begun is of use
      status_of(process.id);
    }
  }
}

WorkerProcesses::Process WorkerProcesses::start() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw not_started(text_of_error(errno), kCloseSome);
  }
  Process process{started_++, -1, io::Descriptor(ends[0]), {}, false};
  const io::Descriptor its(ends[1]);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, its.number(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, its.number(), STDOUT_FILENO);
  // exec in place of fork: what MPI has begun in this process is not there in the other.
  std::array<std::string, 4> words = {"trihedron", "campaign", campaign_file_, "--serve"};
  std::array<char*, 5> arguments = {words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
  const int fault = ::posix_spawn(&process.id, kThisProgram, &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (fault != 0) {
    throw not_started(text_of_error(fault), fault == ENOENT ? "mount /proc" : kCloseSome);
  }
  return process;
}

void WorkerProcesses::give(std::uint64_t worker, std::span<const std::uint64_t> runs) {
  const auto process = std::ranges::find(processes_, worker, &Process::number);
  if (process != processes_.end()) {
    const std::string line = fmt::format("{}\n", fmt::join(runs, " "));
    static_cast<void>(::send(process->socket.number(), line.data(), line.size(), MSG_NOSIGNAL));
  }
}

std::vector<WorkerNews> WorkerProcesses::wait(std::chrono::milliseconds patience) {
  std::vector<pollfd> sockets;
  for (const Process& process : processes_) {
    sockets.push_back({process.socket.number(), POLLIN, 0});
  }
  std::vector<WorkerNews> news;
  if (::poll(sockets.data(), sockets.size(), static_cast<int>(patience.count())) > 0) {
    for (std::size_t i = 0; i < sockets.size(); ++i) {
      if (sockets[i].revents != 0) {
        listen(processes_[i], news);
      }
    }
  }
  return news;
}

void WorkerProcesses::listen(Process& process, std::vector<WorkerNews>& news) {
  std::array<char, 1 << 14> buffer{};
  const ssize_t got = ::recv(process.socket.number(), buffer.data(), buffer.size(), 0);
  if (got < 0 && errno == EINTR) {
    return;
  }
  if (got <= 0) {
    const int status = status_of(std::exchange(process.id, -1));
    if (process.is_ready) {
      news.push_back({process.number, true, how_it_ended(status)});
    } else {
      check_stop();  // which has perhaps reached that process as well
      if (!WIFSIGNALED(status)) {
        throw not_started(how_it_ended(status), "look for what it has said");
      }
      if (++killed_at_start_ == kMostKilledAtStart) {
        throw not_started(how_it_ended(status), kCloseSome);
      }
    }
    process = start();
    return;
  }
  process.said.append(buffer.data(), static_cast<std::size_t>(got));
  for (std::size_t end = process.said.find('\n'); end != std::string::npos; end = process.said.find('\n')) {
    news.push_back({process.number, false, process.said.substr(0, end)});
    process.said.erase(0, end + 1);
    process.is_ready = true;
    killed_at_start_ = 0;
  }
}

}  // namespace trihedron::cli
