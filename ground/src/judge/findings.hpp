#pragma once
/// What those who judge have in common.

#include <string>
#include <vector>

#include "trihedron/records/finding.hpp"

namespace trihedron::ground {

/// Adds a finding of its usual severity.
void add(std::vector<Finding>& findings, FindingCode code, std::string text, std::string evidence, std::string cure);

/// The same of another severity.
void add(std::vector<Finding>& findings, FindingCode code, Finding::Severity severity, std::string text,
         std::string evidence, std::string cure);

/// Trustworthy where none of the findings says "do not use".
[[nodiscard]] Verdict verdict_of(std::vector<Finding> findings);

/// Whether a sum of squares of so many normal numbers is one that chance passes more often than once in a hundred
/// thousand.
[[nodiscard]] bool is_chance(double square, int degrees_of_freedom);

}  // namespace trihedron::ground
