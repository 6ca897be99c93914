#include "stop_on_signals.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "trihedron/records/stop.hpp"

namespace trihedron::cli {
namespace {

// A signal is for the whole process, and its handler knows nothing but what is global.
StopRequest request;
volatile std::sig_atomic_t received = 0;

extern "C" void receive(int signal) {
  received = signal;
  request.make();
}

}  // namespace

int stopped_by_signals(const std::function<int()>& program) {
  struct sigaction action {};
  action.sa_handler = receive;  // without SA_RESTART: what waits for a pipe has to wake up
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) {
      ::sigaction(signal, &action, nullptr);
    }
  }
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is told as a full disk is
  const StopScope scope(&request);
  int status = EXIT_FAILURE;
  try {
    status = program();
  } catch (const Stopped&) {
    std::fflush(stdout);
  }
  if (received != 0) {
    std::signal(received, SIG_DFL);
    std::raise(received);
  }
  return status;
}

}  // namespace trihedron::cli
