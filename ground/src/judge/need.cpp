#include "judge/need.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "trihedron/records/text.hpp"

namespace trihedron::ground {
namespace {

std::string causes_in_words(const std::vector<ErrorCause>& causes) {
  constexpr double kTold = 0.1;
  std::string text;
  for (const ErrorCause& cause : causes) {
    if (text.empty() || cause.share >= kTold) {
      text += fmt::format("{}{} ({:.0f} %)", text.empty() ? "" : ", ", cause.name, 100 * cause.share);
    }
  }
  return text;
}

/// By whether more than half of the error is noise; what the parameters make of it, a longer pass makes smaller.
std::string cure_of_need(const NeedForecast& need) {
  double noise = 0;
  for (const ErrorCause& cause : need.causes) {
    noise += cause.is_parameter ? 0 : cause.share;
  }
  const bool by_parameter = noise < 0.5;
  const std::string better = by_parameter
                                 ? "Calibrate on a longer pass, with slews, or on several passes of this start-up."
                                 : "A longer pass will not help: it is noise of the gyros.";
  if (need.accuracy.within < std::chrono::minutes(1)) {
    return better;
  }
  return fmt::format("{} Or correct every {}, for which it is kept.", better, time_in_words(need.accuracy.within));
}

}  // namespace

bool fails_a_need_alone(const Verdict& verdict) {
  return verdict.has(FindingCode::kNeedNotMet) && std::ranges::none_of(verdict.findings, [](const Finding& finding) {
           return finding.severity == Finding::Severity::kDoNotUse && finding.code != FindingCode::kNeedNotMet;
         });
}

void judge_need(const std::optional<OpenLoopForecast>& forecast, std::vector<Finding>& findings) {
  if (!forecast || !forecast->need || forecast->need->met) {
    return;
  }
  const NeedForecast& need = *forecast->need;
  const bool is_known = std::isfinite(need.error_997_rad);
  findings.push_back(
      {FindingCode::kNeedNotMet,
       fmt::format("The need is not met: {} after an astro-correction (99.7 %).", in_words(need.need)),
       is_known ? fmt::format("predicted {} by then; what it is made of at the end, with what is correlated: {}",
                              angle_text(need.error_997_rad), causes_in_words(need.causes))
                : "the momenta come too near to one line to give an attitude",
       cure_of_need(need)});
}

}  // namespace trihedron::ground
