#include "replay_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "summary.hpp"
#include "terminal.hpp"
#include "trihedron/records/application_names.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/readiness.hpp"
#include "trihedron/records/status.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

constexpr std::size_t kRejectionsShown = 3;
constexpr auto kBetweenDraws = std::chrono::milliseconds(200);
constexpr Duration kBetweenLines = std::chrono::minutes(1);

std::string sigmas_text(const Housekeeping& record) {
  const AngleUnit unit = unit_of_angles(record.sigma_rad);
  return fmt::format("{} {} {}", angle_text(record.sigma_rad[0], unit), angle_text(record.sigma_rad[1], unit),
                     angle_text(record.sigma_rad[2], unit));
}

std::string speed_text(double speed) {
  return speed == ground::kAtOnce ? "as fast as can be" : fmt::format("{:g} × real time", speed);
}

/// A row for each parameter, a column for each gyro. Of three gyros they fit into 80 columns.
void add_parameters(const Calibration& calibration, std::vector<std::string>& lines) {
  constexpr int kColumn = 22;
  std::string head = fmt::format("{:<12}", "Parameters");
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    head += fmt::format("{:<{}}", fmt::format("gyro {}, rad/s", k + 1), kColumn);
  }
  lines.push_back(head);
  const std::size_t of_one = calibration.states.size() / calibration.gyros.size();
  for (std::size_t row = 0; row < of_one; ++row) {
    std::string line;
    for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
      const ParameterId& state = calibration.states[k * of_one + row];
      const GyroCalibration& gyro = calibration.gyros[k];
      const double value = value_of(calibration, state);
      const double sigma = sigma_of(calibration, state);
      const std::size_t coefficients = gyro.drift_rad_s.size();
      if (line.empty()) {
        line = fmt::format("  {:<10}", row < coefficients ? coefficient_names(gyro.drift_model)[row]
                                                          : fmt::format("align_{}", "xyz"[row - coefficients]));
      }
      line += fmt::format("{:<{}}",
                          row < coefficients
                              ? fmt::format("{} ± {}", figure("{:+.4e}", value), figure("{:.1e}", sigma))
                              : fmt::format("{}{} ± {}", value > 0 ? "+" : "", angle_text(value), angle_text(sigma)),
                          kColumn);
    }
    lines.push_back(line);
  }
}

}  // namespace

std::string duration_text(ground::Clock::duration duration) {
  const double s = std::chrono::duration<double>(duration).count();
  const auto [unit, symbol] = s < 1e-3 ? std::pair(1e-6, "µs") : s < 1 ? std::pair(1e-3, "ms") : std::pair(1.0, "s");
  return fmt::format("{} {}", three_digits(s / unit), symbol);
}

std::string percentiles_text(const ground::Durations& durations) {
  if (durations.count() == 0) {
    return "none yet";
  }
  return fmt::format("50 % {}, 99 % {}, 99.9 % {}, longest {}", duration_text(durations.percentile(0.5)),
                     duration_text(durations.percentile(0.99)), duration_text(durations.percentile(0.999)),
                     duration_text(durations.longest()));
}

std::string faults_text(std::uint32_t faults) {
  std::string text;
  for (const FaultRow& row : kFaultRows) {
    if ((faults & static_cast<std::uint32_t>(row.fault)) != 0) {
      text += fmt::format("{}{}", text.empty() ? "" : ", ", row.name);
    }
  }
  return text.empty() ? "none" : text;
}

std::vector<std::string> screen_of(const ReplayMoment& moment) {
  const Housekeeping& record = moment.record;
  const PassSettings& settings = moment.settings;
  const auto since = [&](Time t) { return minutes(t - settings.epoch); };
  std::vector<std::string> lines;
  lines.push_back(fmt::format("Replay      {}, minute {:.1f} of {:.1f}, {}", printable(settings.spacecraft),
                              since(moment.t), minutes(settings.duration), speed_text(moment.speed)));
  lines.push_back(
      fmt::format("Mode        {}; faults: {}", name_of(static_cast<Mode>(record.mode)), faults_text(record.faults)));
  if (record.attitude_valid != 0) {
    lines.push_back(fmt::format("Attitude    q_in_c {:+.9f} {:+.9f} {:+.9f} {:+.9f}", record.q_in_c[0],
                                record.q_in_c[1], record.q_in_c[2], record.q_in_c[3]));
    const double age_s = static_cast<double>(record.time_ns - record.corrected_ns) / 1e9;
    lines.push_back(fmt::format("Sigmas      {} about c x, y, z; corrected {:.1f} s ago", sigmas_text(record), age_s));
  } else {
    lines.emplace_back("Attitude    none");
    lines.emplace_back("Sigmas      —");
  }
  lines.push_back(fmt::format("Readiness   {}", readiness_in_words(record)));
  lines.push_back(fmt::format("Calibration {}adoptions {}, taken back {}; residuals {:.2f}, navigator {:.2f}",
                              record.adopted != 0 ? "in use; " : "unused; ", record.adoptions, record.withdrawals,
                              record.residual_ratio, record.navigation_ratio));
  lines.push_back(fmt::format("Samples     {} used, {} thinned, {} rejected; gaps {}, clock set back {}",
                              record.samples_used, record.samples_thinned, record.samples_rejected, record.gaps,
                              record.clock_set_backs));
  lines.push_back(fmt::format("Fixes       {} used, {} rejected, {} not looked at; filter restarts {}",
                              record.fixes_used, record.fixes_rejected, record.fixes_ignored, record.filter_restarts));
  for (std::size_t i = 0; i < kRejectionsShown; ++i) {
    const std::string_view title = i == 0 ? "Rejections" : "";
    if (i < moment.rejections.size()) {
      const Rejections& its = moment.rejections[i];
      lines.push_back(fmt::format("{:<12}minute {:.1f}: {} {}{}", title, since(its.last), its.what, its.why,
                                  its.count > 1 ? fmt::format(", {} in a row", its.count) : ""));
    } else {
      lines.push_back(i == 0 ? fmt::format("{:<12}none", title) : "");
    }
  }
  lines.push_back(fmt::format("Call        {}", percentiles_text(moment.timing.calls)));
  if (moment.speed != ground::kAtOnce) {
    lines.push_back(fmt::format("Late        {}", percentiles_text(moment.timing.late)));
  }
  if (moment.confirmed) {
    lines.push_back(fmt::format("Confirmed   up to minute {:.2f}", since(*moment.confirmed)));
  }
  if (moment.calibration) {
    add_parameters(*moment.calibration, lines);
  }
  return lines;
}

std::string line_of(const ReplayMoment& moment) {
  const Housekeeping& record = moment.record;
  std::string text(name_of(static_cast<Mode>(record.mode)));
  if (record.faults != 0) {
    text += fmt::format(" ({})", faults_text(record.faults));
  }
  text += record.attitude_valid != 0 ? fmt::format(", sigma {}", sigmas_text(record)) : ", no attitude";
  if (record.predicted != 0) {
    text += fmt::format(", ready for {:.0f} min", std::floor(readiness_s(record) / 60));
  }
  return fmt::format("{}, fixes {} used {} rejected, call {} (99 % {})", text, record.fixes_used, record.fixes_rejected,
                     duration_text(moment.timing.calls.percentile(0.5)),
                     duration_text(moment.timing.calls.percentile(0.99)));
}

LiveScreen::LiveScreen(std::FILE* terminal) : terminal_(terminal), coloured_(is_coloured(terminal)) {
  print_data(terminal_, "\x1b[?25l");
}

LiveScreen::~LiveScreen() {
  print_data(terminal_, "\x1b[?25h");
  std::fflush(terminal_);
}

void LiveScreen::show(const std::vector<std::string>& lines) {
  const TerminalSize size = size_of(terminal_);
  const std::size_t count = std::min(lines.size(), size.rows - 1);
  std::string text = shown_ > 0 ? fmt::format("\r\x1b[{}A", shown_) : "\r";
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view line = cut_to(lines[i], size.columns - 1);
    const bool is_good = line.starts_with("Mode        navigating");
    const bool is_bad = line.starts_with("Mode        degraded") || line.starts_with("Mode        failed");
    const bool is_marked = coloured_ && (is_good || is_bad);
    text += fmt::format("{}{}{}\x1b[K\n", is_marked ? (is_good ? "\x1b[1;32m" : "\x1b[1;31m") : "", line,
                        is_marked ? "\x1b[0m" : "");
  }
  text += "\x1b[J";
  shown_ = count;
  print_data(terminal_, text);
  std::fflush(terminal_);
}

ReplayView::ReplayView(const Common& common, const ground::ApplicationReplay& replay, const PassSettings& settings,
                       double speed, const ground::Timing& timing)
    : replay_(replay), settings_(settings), speed_(speed), timing_(timing), stream_(common.summary) {
  const Housekeeping record = replay.housekeeping();
  t_ = replay.next_t().value_or(settings.epoch);
  mode_ = replay.mode();
  adoptions_ = record.adoptions;
  withdrawals_ = record.withdrawals;
  if (common.json || common.quiet) {
    return;
  }
  if (is_screen(stream_)) {
    screen_.emplace(stream_);
  } else {
    says_ = true;
  }
}

void ReplayView::say(std::string_view text) const {
  if (says_) {
    print_text(stream_, fmt::format("{:8.2f} min  {}\n", minutes(t_ - settings_.epoch), text));
    std::fflush(stream_);
  }
}

void ReplayView::note_rejection(std::string_view what, std::string_view why, Time t, bool is_rejected) {
  bool& in_a_row = in_a_row_[what == "fix" ? 0 : 1];
  const auto latest = std::ranges::find(rejections_, what, &Rejections::what);
  if (is_rejected && in_a_row && latest != rejections_.end() && latest->why == why) {
    latest->last = t;
    ++latest->count;
  } else if (is_rejected) {
    rejections_.push_front({what, why, t, 1});
    rejections_.resize(std::min(rejections_.size(), kRejectionsShown));
    say(fmt::format("{} {}", what, why));
  }
  in_a_row = is_rejected;
}

void ReplayView::note_record(const StepReport& report) {
  const bool may_have_changed = report.fix.used() || report.fix.status == FixStatus::kEstimateLost;
  if (!may_have_changed && replay_.mode() == mode_) {
    return;
  }
  const Housekeeping record = replay_.housekeeping();
  if (replay_.mode() != mode_) {
    mode_ = replay_.mode();
    say(fmt::format("mode {}; faults: {}", name_of(mode_), faults_text(record.faults)));
  }
  if (record.adoptions != adoptions_) {
    say(fmt::format("calibration adopted: {}", readiness_in_words(record)));
  }
  if (record.withdrawals != withdrawals_) {
    say("calibration taken back");
  }
  adoptions_ = record.adoptions;
  withdrawals_ = record.withdrawals;
}

void ReplayView::note(const StepReport& report) {
  t_ = report.sample != SampleStatus::kNone ? report.t : t_;
  if (!says_ && !screen_) {
    return;
  }
  if (report.sample != SampleStatus::kNone) {
    const bool is_rejected = report.sample != SampleStatus::kThinned && trihedron::is_rejected(report.sample);
    note_rejection("sample", name_of(report.sample), report.t, is_rejected);
  }
  if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
    note_rejection("fix", name_of(report.fix.status), report.fix.t, trihedron::is_rejected(report.fix.status));
  }
  if (!says_) {
    return;
  }
  note_record(report);
  if (!next_line_) {
    next_line_ = t_ + kBetweenLines;
  }
  if (t_ >= *next_line_) {
    next_line_ = t_ + kBetweenLines;
    const Housekeeping record = replay_.housekeeping();
    say(line_of({settings_, speed_, t_, record, std::nullopt, rejections_, timing_, confirmed_}));
  }
}

void ReplayView::draw() {
  const Housekeeping record = replay_.housekeeping();
  screen_->show(screen_of({settings_, speed_, t_, record, replay_.calibration(), rejections_, timing_, confirmed_}));
}

void ReplayView::look(ground::Clock::time_point now) {
  if (screen_ && (!next_draw_ || now >= *next_draw_)) {
    next_draw_ = now + kBetweenDraws;
    draw();
  }
}

void ReplayView::end() {
  if (screen_) {
    draw();
    screen_.reset();
  }
}

}  // namespace trihedron::cli
