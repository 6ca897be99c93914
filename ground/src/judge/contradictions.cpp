#include "judge/contradictions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace trihedron::ground {
namespace {

/// Rejected fixes of one star tracker, one after the other, and the fix after them.
struct Rejected {
  std::span<const FixRecord> fixes;
  const FixRecord* next = nullptr;  ///< none at the end of the pass
};

/// `fixes`: by star tracker, those of each in the order of their times.
std::vector<Rejected> rejected_in_a_row(const std::vector<FixRecord>& fixes) {
  std::vector<Rejected> found;
  for (auto begin = fixes.begin(); begin != fixes.end();) {
    const auto end = std::find_if_not(begin, fixes.end(), [&](const FixRecord& fix) {
      return fix.head == begin->head && fix.status == FixStatus::kRejectedByGate;
    });
    if (end - begin >= Statistics::kInARow) {
      const bool has_next = end != fixes.end() && end->head == begin->head;
      found.push_back({{begin, end}, has_next ? &*end : nullptr});
    }
    begin = std::max(end, std::next(begin));
  }
  return found;
}

/// The one gyro that rejected fixes contradict; none where they contradict several, or not that clearly.
std::optional<std::size_t> contradicted_alone(std::span<const FixRecord> fixes) {
  constexpr double kContradicted = 18.4;  // 99.99 % of two components
  constexpr double kAlmostAll = 0.9;
  const std::size_t gyros = fixes.front().innovation.size() / 2;
  const auto count = static_cast<double>(fixes.size());
  std::optional<std::size_t> alone;
  for (std::size_t k = 0; k < gyros; ++k) {
    const auto beyond = static_cast<double>(std::ranges::count_if(fixes, [&](const FixRecord& fix) {
      double square = 0;
      for (std::size_t i = 2 * k; i < 2 * k + 2 && i < fix.innovation.size(); ++i) {
        square += fix.innovation_sigma[i] > 0 ? std::pow(fix.innovation[i] / fix.innovation_sigma[i], 2) : 0;
      }
      return square > kContradicted;
    }));
    if (beyond > kAlmostAll * count) {
      if (alone) {
        return std::nullopt;
      }
      alone = k;
    } else if (beyond > (1 - kAlmostAll) * count) {
      return std::nullopt;
    }
  }
  return alone;
}

/// Whether what most of the fixes are off a gyro is so much that a star tracker would have to be off about the momentum
/// of another, to a degree, to contradict this one alone.
bool is_far_off(std::span<const FixRecord> fixes, std::size_t gyro) {
  constexpr double kFar_rad = 5e-3;
  const auto far = std::ranges::count_if(fixes, [gyro](const FixRecord& fix) {
    return fix.innovation.size() > 2 * gyro + 1 &&
           std::hypot(fix.innovation[2 * gyro], fix.innovation[2 * gyro + 1]) > kFar_rad;
  });
  return 2 * far > std::ssize(fixes);
}

/// Whether readings of a gyro that had leapt were used again just before.
bool follows_a_leap(const Rejected& rejected, const std::vector<GyroEvent>& events) {
  constexpr Duration kJustBefore = std::chrono::minutes(1);
  PerGyro<bool> had_leapt{};
  for (const GyroEvent& event : events) {
    const Duration before = rejected.fixes.front().t - event.t;
    if (event.state == GyroState::kUsed && had_leapt[event.gyro] && before >= Duration{0} && before < kJustBefore) {
      return true;
    }
    had_leapt[event.gyro] = event.state == GyroState::kLeapt;
  }
  return false;
}

std::string extent_text(const Rejected& rejected, Time epoch) {
  return fmt::format("{} fixes from {:.1f} min on", rejected.fixes.size(),
                     to_seconds(rejected.fixes.front().t - epoch) / 60);
}

}  // namespace

void judge_contradictions(std::vector<FixRecord> fixes, const std::vector<GyroEvent>& events, Time epoch,
                          std::vector<Finding>& findings) {
  const auto found = [&](FindingCode code) { return std::ranges::find(findings, code, &Finding::code); };
  std::ranges::stable_sort(fixes, {}, [](const FixRecord& fix) { return std::pair(fix.head, fix.t); });
  std::vector<std::string> by_gyros;
  std::size_t given_in_to = 0;
  bool is_star_tracker = false;
  for (const Rejected& rejected : rejected_in_a_row(fixes)) {
    const std::string extent = extent_text(rejected, epoch);
    const std::optional<std::size_t> alone = contradicted_alone(rejected.fixes);
    if (rejected.next == nullptr) {
      // A star tracker that is off contradicts all gyros, but for a turn about the momentum of one.
      if (alone && found(FindingCode::kGyroMountingMoved) == findings.end()) {
        findings.push_back(
            {FindingCode::kGyroMountingMoved,
             "Up to the end of the pass all fixes contradict one gyro alone, and were rejected: its case has moved, or "
             "the star tracker has turned about the momentum of the other.",
             fmt::format("gyro {}, {}", *alone + 1, extent),
             "Cut the pass there and calibrate on the parts apart; look for what happened at that time."});
      }
      is_star_tracker = is_star_tracker || !alone;
      continue;
    }
    if (follows_a_leap(rejected, events)) {
      by_gyros.push_back(extent + ", after readings that had leapt were used again");
    } else if (alone && is_far_off(rejected.fixes, *alone)) {
      by_gyros.push_back(fmt::format("gyro {}, {}", *alone + 1, extent));
    } else {
      is_star_tracker = true;
    }
    const bool is_reopened =
        rejected.next->status == FixStatus::kUsedAfterReopening || rejected.next->status == FixStatus::kRestarted;
    given_in_to += is_reopened && rejected.fixes.front().jumped ? rejected.fixes.size() : 0;
  }
  if (!by_gyros.empty()) {
    std::erase_if(findings, [&](const Finding& finding) {
      return finding.code == FindingCode::kStarTrackerOff && !is_star_tracker;
    });
    findings.push_back({FindingCode::kGyroContradicted,
                        "For a while the readings of a gyro, not the fixes, were wrong: the fixes contradict it and "
                        "were rejected, and the attitude there is by these readings.",
                        fmt::format("{}", fmt::join(by_gyros, "; ")),
                        "Look at the telemetry of the gyro there, leave that part out and calibrate on the parts "
                        "apart."});
  }
  if (const auto reopened = found(FindingCode::kReopened); reopened != findings.end() && given_in_to > 0) {
    reopened->severity = FindingSeverity::kDoNotUse;
    reopened->text =
        "The fixes contradicted the momenta from one moment on, and were rejected until the filter set the momenta "
        "free: whichever was wrong, the attitude until then or from then on is.";
    reopened->evidence += fmt::format("; {} fixes after a jump", given_in_to);
    reopened->cure = "Look what happened there to the star tracker or to a gyro, and calibrate on the parts apart.";
  }
}

}  // namespace trihedron::ground
