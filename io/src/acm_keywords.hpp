#pragma once
/// Names that writer and reader of a calibration as ACM share.

#include <string>
#include <string_view>

#include "trihedron/records/drift_models.hpp"

namespace trihedron::io {

inline constexpr std::string_view kAcmPrefix = "USER_DEFINED_TRIHEDRON_";
/// Before the name of a statistic.
inline constexpr std::string_view kAcmStatistic = "STATISTIC_";
/// Attribute of the covariance file: names of its states, with blanks between.
inline constexpr const char* kCovarianceStates = "states";

/// "K0", "W_2_M1" for W(2,-1): what may stand in a keyword.
[[nodiscard]] std::string acm_keyword(std::string_view name);
/// "GYRO1_FIELD_W2"
[[nodiscard]] std::string acm_field_level(int gyro, DriftCoefficient::Member potential, int degree);

}  // namespace trihedron::io
