#include "trihedron/ground/evaluate/evaluate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <limits>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

constexpr Duration kSameEpoch = std::chrono::microseconds(500);

ErrorStatistics statistics_of(const AttitudeErrors& errors, std::size_t begin, std::size_t end) {
  ErrorStatistics result;
  result.count = end - begin;
  if (begin == end) {
    return result;
  }
  result.from = errors.t[begin];
  result.to = errors.t[end - 1];
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double normalised = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d& e = errors.error_rad[i];
    squares += e.cwiseAbs2();
    result.max_rad = result.max_rad.cwiseMax(e.cwiseAbs());
    result.max_total_rad = std::max(result.max_total_rad, e.norm());
    if (!errors.sigma_rad.empty()) {
      normalised += e.cwiseQuotient(errors.sigma_rad[i]).squaredNorm() / 3;
    }
  }
  const auto count = static_cast<double>(result.count);
  result.rms_rad = (squares / count).cwiseSqrt();
  if (!errors.sigma_rad.empty()) {
    result.normalised_square = normalised / count;
  }
  return result;
}

/// The first epoch of the stretch that begins at `boundary`. A correction by the fix at that time shows a little later,
/// when the samples after the fix are known: the errors until then are of the stretch before.
std::size_t end_of_stretch(const AttitudeErrors& errors, Time boundary) {
  constexpr Duration kUntilCorrectionShows = std::chrono::seconds(10);
  const auto at = [&](Time t) {
    return static_cast<std::size_t>(std::ranges::lower_bound(errors.t, t) - errors.t.begin());
  };
  const std::size_t first = at(boundary);
  if (errors.age_s.empty()) {
    return first;
  }
  for (std::size_t i = first; i < at(boundary + kUntilCorrectionShows); ++i) {
    if (errors.t[i] - from_seconds(errors.age_s[i]) > boundary - kSameEpoch) {
      return i;
    }
  }
  return first;
}

}  // namespace

AttitudeErrors attitude_errors(const AttitudeHistory& solution, const std::vector<Time>& reference_t,
                               const std::vector<Eigen::Quaterniond>& reference_q_in_c) {
  AttitudeErrors errors;
  std::size_t r = 0;
  for (std::size_t i = 0; i < solution.size(); ++i) {
    while (r < reference_t.size() && reference_t[r] < solution.t[i] - kSameEpoch) {
      ++r;
    }
    if (r == reference_t.size()) {
      break;
    }
    if (reference_t[r] > solution.t[i] + kSameEpoch) {
      continue;
    }
    const auto reference = Rot<In, C>::assume(reference_q_in_c[r].normalized());
    const auto estimate = Rot<In, C>::assume(solution.q_in_c[i].normalized());
    const Eigen::Vector3d error = (reference.inverse() * estimate).log().raw();
    if (!error.allFinite()) {  // a reference from telemetry may hold what is no rotation
      continue;
    }
    errors.t.push_back(solution.t[i]);
    errors.error_rad.push_back(error);
    if (!solution.sigma_rad.empty()) {
      errors.sigma_rad.push_back(solution.sigma_rad[i]);
    }
    if (!solution.age_s.empty()) {
      errors.age_s.push_back(solution.age_s[i]);
    }
  }
  return errors;
}

std::optional<double> true_value(const Truth& truth, const ParameterId& parameter) {
  if (parameter.kind == ParameterId::Kind::kFurtherState || parameter.gyro() >= truth.gyros.size()) {
    return std::nullopt;
  }
  const Truth::Gyro& gyro = truth.gyros[parameter.gyro()];
  return parameter.is_alignment() ? gyro.alignment_rotation_vector_rad(parameter.component)
                                  : gyro.drift(parameter.coefficient);
}

double normalised_square(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd per_sigma = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd scaled = per_sigma.cwiseProduct(error);
  const Eigen::LLT<Eigen::MatrixXd> correlation(per_sigma.asDiagonal() * covariance * per_sigma.asDiagonal());
  return correlation.info() == Eigen::Success ? scaled.dot(correlation.solve(scaled))
                                              : std::numeric_limits<double>::quiet_NaN();
}

Eigen::VectorXd estimate_minus_truth(const Calibration& calibration, const Truth& truth, UnnamedDrift unnamed) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto C_c_b = [](const Eigen::Vector3d& rotation_vector_rad) {
    return Rot<C, B<1>>::exp(Vec<C>::assume(rotation_vector_rad));
  };
  Eigen::VectorXd errors(static_cast<Eigen::Index>(calibration.states.size()));
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    const ParameterId& state = calibration.states[static_cast<std::size_t>(i)];
    const std::size_t k = state.gyro();
    const std::optional<double> true_one = true_value(truth, state);
    if (state.is_alignment()) {
      errors(i) = true_one ? (C_c_b(calibration.gyros[k].alignment_rotation_vector_rad) *
                              C_c_b(truth.gyros[k].alignment_rotation_vector_rad).inverse())
                                 .log()
                                 .raw()(state.component)
                           : kNone;
    } else {
      const bool is_known = true_one || (unnamed == UnnamedDrift::kIsZero && k < truth.gyros.size());
      errors(i) = is_known ? value_of(calibration, state) - true_one.value_or(0) : kNone;
    }
  }
  return errors;
}

ErrorStatistics statistics(const AttitudeErrors& errors) { return statistics_of(errors, 0, errors.t.size()); }

std::vector<ErrorStatistics> statistics_by_stretch(const AttitudeErrors& errors, Time start, Duration length) {
  std::vector<ErrorStatistics> stretches;
  for (std::size_t begin = 0; begin < errors.t.size();) {
    const auto number = (errors.t[begin] - start) / length;
    const std::size_t end = end_of_stretch(errors, start + (number + 1) * length);
    stretches.push_back(statistics_of(errors, begin, end));
    begin = end;
  }
  return stretches;
}

std::vector<CorrectionInterval> correction_intervals(const AttitudeErrors& errors, double limit_rad) {
  std::vector<CorrectionInterval> intervals;
  for (std::size_t i = 0; i < errors.age_s.size(); ++i) {
    const Time corrected = errors.t[i] - from_seconds(errors.age_s[i]);
    if (intervals.empty() || corrected > intervals.back().corrected + kSameEpoch) {
      CorrectionInterval next;
      next.corrected = corrected;
      intervals.push_back(next);
    }
    CorrectionInterval& now = intervals.back();
    const double total_rad = errors.error_rad[i].norm();
    now.observed = from_seconds(errors.age_s[i]);
    now.max_total_rad = std::max(now.max_total_rad, total_rad);
    if (!now.passed && !(total_rad <= limit_rad)) {
      now.passed = now.observed;
    }
  }
  return intervals;
}

std::optional<double> IntervalPair::extension() const {
  if (!known_before.passed || calibrated.observed == Duration::zero()) {
    return std::nullopt;
  }
  // Passed at the very correction: it lasted less than the step of the reference.
  const double before_s = std::max(to_seconds(*known_before.passed), 1.0);
  return to_seconds(calibrated.passed.value_or(calibrated.observed)) / before_s;
}

std::optional<Extension> median_extension(const std::vector<IntervalPair>& pairs) {
  std::vector<Extension> factors;
  for (const IntervalPair& pair : pairs) {
    if (const auto factor = pair.extension()) {
      factors.push_back({*factor, !pair.calibrated.passed});
    }
  }
  if (factors.empty()) {
    return std::nullopt;
  }
  std::ranges::sort(factors, {}, &Extension::factor);
  const auto median = factors.begin() + static_cast<std::ptrdiff_t>((factors.size() - 1) / 2);
  return Extension{median->factor, std::any_of(factors.begin(), median + 1,
                                               [](const Extension& factor) { return factor.is_lower_bound; })};
}

std::vector<IntervalPair> paired(const std::vector<CorrectionInterval>& known_before,
                                 const std::vector<CorrectionInterval>& calibrated) {
  std::vector<IntervalPair> pairs;
  for (const CorrectionInterval& after : calibrated) {
    const auto before = std::ranges::find_if(known_before, [&](const CorrectionInterval& interval) {
      return std::chrono::abs(interval.corrected - after.corrected) <= std::chrono::seconds(2);
    });
    if (before != known_before.end()) {
      pairs.push_back({*before, after});
    }
  }
  return pairs;
}

}  // namespace trihedron::ground
