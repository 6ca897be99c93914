#include "terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "transport.hpp"

namespace trihedron::cli {
namespace {

bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80; }

}  // namespace

// mpirun gives its ranks a terminal of its own, whose text it passes on to wherever its own output goes.
bool is_terminal(std::FILE* stream) { return ::isatty(::fileno(stream)) == 1 && !is_in_a_job(); }

bool is_screen(std::FILE* stream) {
  const char* const terminal = std::getenv("TERM");  // NOLINT(concurrency-mt-unsafe): nothing sets it
  return terminal != nullptr && std::string_view(terminal) != "dumb" && is_terminal(stream);
}

bool is_coloured(std::FILE* stream) {
  const char* const no_color = std::getenv("NO_COLOR");  // NOLINT(concurrency-mt-unsafe)
  return (no_color == nullptr || *no_color == '\0') && is_screen(stream);
}

TerminalSize size_of(std::FILE* terminal) {
  struct winsize size {};
  if (::ioctl(::fileno(terminal), TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) {
    return {};
  }
  return {size.ws_row, size.ws_col};
}

std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, begins_character));
}

std::string_view cut_to(std::string_view text, std::size_t columns) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (begins_character(text[i]) && columns-- == 0) {
      return text.substr(0, i);
    }
  }
  return text;
}

}  // namespace trihedron::cli
