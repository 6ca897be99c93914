#include "progress.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <utility>

#include "standard_streams.hpp"

namespace trihedron::cli {

ProgressBar::ProgressBar(std::string what, bool quiet)
    : what_(std::move(what)), shown_(!quiet && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (shown_) {
    say("\r\033[K");
  }
}

std::function<void(double)> ProgressBar::meter() const {
  if (!shown_) {
    return {};
  }
  return [this](double fraction) {
    constexpr int kWidth = 40;
    const int full = static_cast<int>(fraction * kWidth);
    say(fmt::format("\r{} [{:=<{}}{: <{}}] {:3.0f} %", what_, "", full, "", kWidth - full, 100 * fraction));
  };
}

}  // namespace trihedron::cli
