#pragma once
/// Numbers and times as people read them.

#include <Eigen/Core>
#include <string>

#include "trihedron/core/time.hpp"
#include "trihedron/ground/evaluate/attitude_evaluation.hpp"

namespace trihedron::report {

/// "−1.50": fixed decimals, a true minus, thousands apart; "—" for what is no number.
[[nodiscard]] std::string number(double value, int decimals);

/// The same with its sign always: "+1.50".
[[nodiscard]] std::string signed_number(double value, int decimals);

/// To so many significant digits, never with an exponent.
[[nodiscard]] std::string significant(double value, int digits);

/// "1.2 / 0.9 / 3.4″": roll, pitch, heading in one unit that suits their size.
[[nodiscard]] std::string of_axes(const Eigen::Vector3d& v);

/// "2.9″", "5′": in the unit that suits its size, "—" for what is no number.
[[nodiscard]] std::string angle(double rad, int digits);

/// "5′", "90″": of a limit, without zeros at its end.
[[nodiscard]] std::string limit_text(double rad);

/// Decimals that show two significant digits of `sigma`.
[[nodiscard]] int decimals_for(double sigma);

/// "1 fix", "2 fixes".
[[nodiscard]] std::string counted(long count, const std::string& one, const std::string& many);

/// "2009-05-20 00:00:00 TAI"
[[nodiscard]] std::string calendar(Time t);

/// "9 h 00 min", "42 min", "12 s"
[[nodiscard]] std::string span(Duration d);

/// "the truth", "the star tracker"
[[nodiscard]] std::string reference_in_words(const ground::AttitudeEvaluation& evaluation);

}  // namespace trihedron::report
