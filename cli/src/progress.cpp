#include "progress.hpp"

#include <fmt/core.h>

#include <chrono>
#include <string>
#include <string_view>
#include <utility>

#include "standard_streams.hpp"
#include "terminal.hpp"

namespace trihedron::cli {

ProgressBar::ProgressBar(std::string what, bool quiet)
    : what_(std::move(what)), shown_(!quiet && is_terminal(stderr)) {}

ProgressBar::~ProgressBar() {
  if (shown_) {
    say("\r\033[K");
  }
}

Progress ProgressBar::meter() const {
  if (!shown_) {
    return {};
  }
  return [this](std::string_view doing, double fraction) {
    constexpr int kWidth = 40;
    const std::string label = doing.empty() ? what_ : fmt::format("{}: {}", what_, doing);
    const int full = static_cast<int>(fraction * kWidth);
    say(fraction > 0
            ? fmt::format("\r\033[K{} [{:=<{}}{: <{}}] {:3.0f} %", label, "", full, "", kWidth - full, 100 * fraction)
            : fmt::format("\r\033[K{} …", label));
  };
}

namespace {

/// "42 s", "12 min", "3.4 h"
std::string about(double seconds) {
  constexpr double kMinute = 60;
  constexpr double kHour = 3600;
  if (seconds < 2 * kMinute) {
    return fmt::format("{:.0f} s", seconds);
  }
  return seconds < 2 * kHour ? fmt::format("{:.0f} min", seconds / kMinute) : fmt::format("{:.1f} h", seconds / kHour);
}

}  // namespace

RunCounter::RunCounter(std::string what, std::size_t done, std::size_t all, bool quiet)
    : what_(std::move(what)), before_(done), done_(done), all_(all), shown_(!quiet && is_terminal(stderr)) {
  show();
}

RunCounter::~RunCounter() {
  if (shown_) {
    say("\r\033[K");
  }
}

void RunCounter::add() {
  ++done_;
  show();
}

void RunCounter::show() const {
  if (!shown_ || all_ == 0) {
    return;
  }
  constexpr int kWidth = 30;
  const int full = static_cast<int>(kWidth * done_ / all_);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  const auto here = static_cast<double>(done_ - before_);
  const std::string pace = here > 0 && seconds > 0
                               ? fmt::format(", {:.3g} runs/s, {} left", here / seconds,
                                             about(seconds / here * static_cast<double>(all_ - done_)))
                               : "";
  say(fmt::format("\r\033[K{} [{:=<{}}{: <{}}] {}/{}{}", what_, "", full, "", kWidth - full, done_, all_, pace));
}

}  // namespace trihedron::cli
