#include "standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace trihedron::cli {

void open_standard_streams() {
  // The wrong way round, as coreutils does: what is printed to a closed standard output must not seem to have arrived.
  constexpr std::array kModes = {O_WRONLY, O_RDONLY, O_RDONLY};
  for (int number = 0; number < static_cast<int>(kModes.size()); ++number) {
    const bool closed = ::fcntl(number, F_GETFD) == -1 && errno == EBADF;
    // The lowest number that is free is this one.
    if (closed && ::open("/dev/null", kModes[static_cast<std::size_t>(number)]) != number) {
      std::_Exit(EXIT_FAILURE);
    }
  }
}

void say(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace trihedron::cli
