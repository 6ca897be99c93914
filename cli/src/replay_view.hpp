#pragma once
/// What a replay of the on-board application shows while it runs: one live screen in a terminal, else lines.

#include <cstdio>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output.hpp"
#include "trihedron/ground/application/play.hpp"

namespace trihedron::cli {

/// Fixes or samples of one kind that were not used, one after the other.
struct Rejections {
  std::string_view what;  ///< "fix" or "sample"
  std::string_view why;
  Time last{};
  long count = 0;
};

/// A moment of a replay.
struct ReplayMoment {
  const PassSettings& settings;
  double speed = 1;
  Time t{};  ///< of the telemetry
  const Housekeeping& record;
  const std::optional<Calibration>& calibration;
  const std::deque<Rejections>& rejections;  ///< the latest first
  const ground::Timing& timing;
  const std::optional<Time>& confirmed;  ///< up to where a snapshot is on the disk
};

/// "12.3 µs"
[[nodiscard]] std::string duration_text(ground::Clock::duration duration);
/// "50 % 12 µs, 99 % 40 µs, 99.9 % 90 µs, longest 3 ms"
[[nodiscard]] std::string percentiles_text(const ground::Durations& durations);
/// "star tracker lost, gap"; "none"
[[nodiscard]] std::string faults_text(std::uint32_t faults);

/// The lines of the live screen.
[[nodiscard]] std::vector<std::string> screen_of(const ReplayMoment& moment);
/// One line of the same.
[[nodiscard]] std::string line_of(const ReplayMoment& moment);

/// Lines of a terminal that are written again and again in the same place. The cursor is hidden as long as it lives.
class LiveScreen {
 public:
  explicit LiveScreen(std::FILE* terminal);
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;
  ~LiveScreen();

  /// Cut to the size of the terminal.
  void show(const std::vector<std::string>& lines);

 private:
  std::FILE* terminal_;
  bool coloured_;
  std::size_t shown_ = 0;  ///< lines above the cursor
};

/// Shows a replay on the stream: a screen a few times a second where it is one, else a line for each minute of the pass
/// and one for whatever changes. Nothing with --quiet and --json.
class ReplayView {
 public:
  /// All of these must outlive it.
  ReplayView(const Common& common, const ground::ApplicationReplay& replay, const PassSettings& settings, double speed,
             const ground::Timing& timing);

  /// After each event.
  void note(const StepReport& report);
  /// Now and then.
  void look(ground::Clock::time_point now);
  void confirmed(Time t) { confirmed_ = t; }
  /// The last look.
  void end();

 private:
  void note_rejection(std::string_view what, std::string_view why, Time t, bool is_rejected);
  void note_record(const StepReport& report);
  void say(std::string_view text) const;
  void draw();

  const ground::ApplicationReplay& replay_;
  const PassSettings& settings_;
  double speed_;
  const ground::Timing& timing_;
  std::FILE* stream_;
  std::optional<LiveScreen> screen_;
  bool says_ = false;
  Time t_{};
  std::optional<Time> next_line_;
  std::optional<ground::Clock::time_point> next_draw_;
  std::optional<Time> confirmed_;
  std::deque<Rejections> rejections_;
  bool in_a_row_[2] = {};  ///< whether the latest fix, or sample, was not used
  Mode mode_ = Mode::kStandby;
  std::uint32_t adoptions_ = 0;
  std::uint32_t withdrawals_ = 0;
};

}  // namespace trihedron::cli
