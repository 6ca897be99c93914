#include "judge/findings.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <utility>

namespace trihedron::ground {

void add(std::vector<Finding>& findings, FindingCode code, std::string text, std::string evidence, std::string cure) {
  findings.push_back({code, std::move(text), std::move(evidence), std::move(cure)});
}

void add(std::vector<Finding>& findings, FindingCode code, Finding::Severity severity, std::string text,
         std::string evidence, std::string cure) {
  findings.push_back({code, std::move(text), std::move(evidence), std::move(cure), severity});
}

Verdict verdict_of(std::vector<Finding> findings) {
  Verdict verdict;
  verdict.findings = std::move(findings);
  verdict.trustworthy = std::ranges::none_of(
      verdict.findings, [](const Finding& finding) { return finding.severity == Finding::Severity::kDoNotUse; });
  return verdict;
}

bool is_chance(double square, int degrees_of_freedom) {
  constexpr double kFalseAlarm = 1e-5;  // of a good pass
  return degrees_of_freedom == 0 || square <= boost::math::quantile(boost::math::complement(
                                                  boost::math::chi_squared(degrees_of_freedom), kFalseAlarm));
}

}  // namespace trihedron::ground
