#include "trihedron/ground/onboard/recorder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

/// Time between recorded corrections: the correction interval of the paper.
constexpr Duration kWatchedCorrections = std::chrono::minutes(90);

/// Estimates in the order of drift_and_alignment().
std::vector<double> parameter_values(const std::vector<GyroCalibration>& gyros) {
  std::vector<double> values;
  for (const GyroCalibration& gyro : gyros) {
    values.insert(values.end(), gyro.drift_rad_s.begin(), gyro.drift_rad_s.end());
    const Eigen::Vector3d& lambda = gyro.alignment_rotation_vector_rad;
    values.insert(values.end(), lambda.begin(), lambda.end());
  }
  return values;
}

Eigen::Matrix3d alignment_of(const GyroCalibration& gyro) {
  return Rot<C, B<1>>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
}

Correction correction_of(const Pipeline& pipeline, const AttitudeSolution& attitude, Time t) {
  Correction correction{t, pipeline.gyros_before(), pipeline.gyros(), pipeline.errors()};
  const Eigen::Matrix3d& C_in_c = attitude.C_in_c.raw();
  for (std::size_t k = 0; k < correction.calibrated.size(); ++k) {
    const GyroCalibration& calibrated = correction.calibrated[k];
    GyroCalibration& before = correction.known_before[k];
    // The momentum as read through the prior parameters at this attitude.
    const Eigen::Vector3d h_b =
        alignment_of(calibrated).transpose() * (C_in_c.transpose() * calibrated.momentum_in) + calibrated.readout_bias;
    before.momentum_in = C_in_c * (alignment_of(before) * without_bias(h_b, before.readout_bias));
  }
  return correction;
}

void append(AttitudeHistory& history, Time t, const AttitudeSolution& solution, Time corrected) {
  ground::append(history, t, solution);
  history.age_s.resize(history.t.size());
  history.age_s.back() = to_seconds(t - corrected);
}

}  // namespace

FixRecord record_of(const StepReport& report, int gyros) {
  FixRecord record;
  record.t = report.fix.t;
  record.head = report.fix.head;
  record.status = report.fix.status;
  const Eigen::Index size = 2L * gyros;
  const bool compared = report.fix.innovation.size() == size;
  for (Eigen::Index row = 0; row < size; ++row) {
    record.innovation.push_back(compared ? report.fix.innovation(row) : 0);
    record.innovation_sigma.push_back(compared ? std::sqrt(report.fix.innovation_covariance(row, row)) : 0);
  }
  record.nis = report.fix.nis;
  record.degrees_of_freedom =
      2 * static_cast<int>(std::count(report.gyros.begin(), report.gyros.begin() + gyros, GyroState::kUsed));
  if (report.compared && report.compared->fix.covariance.is_told()) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of_covariance;
    of_covariance.computeDirect(report.compared->fix.covariance.matrix(), Eigen::EigenvaluesOnly);
    record.told_sigma_rad = std::sqrt(std::max(of_covariance.eigenvalues()(0), 0.0));
  }
  record.jumped = report.fix.jumped;
  record.corrected_navigator = report.corrected;
  return record;
}

void append(AttitudeHistory& history, Time t, const AttitudeSolution& solution) {
  if (!history.t.empty() && history.t.back() == t) {
    history.q_in_c.back() = solution.C_in_c.quaternion();
    history.sigma_rad.back() = solution.covariance_rad2.diagonal().cwiseSqrt();
    return;
  }
  history.t.push_back(t);
  history.q_in_c.push_back(solution.C_in_c.quaternion());
  history.sigma_rad.emplace_back(solution.covariance_rad2.diagonal().cwiseSqrt());
}

void FixSums::add(const FixRecord& fix) {
  ++fixes_;
  components_ = fix.innovation.size();
  used_ += fix.used() ? 1 : 0;
  outliers_ += fix.status == FixStatus::kRejectedByGate ? 1 : 0;
  frozen_ += fix.status == FixStatus::kRejectedFrozen ? 1 : 0;
  const bool was_reopened = fix.status == FixStatus::kUsedAfterReopening || fix.status == FixStatus::kRestarted ||
                            fix.status == FixStatus::kEstimateLost;
  reopened_ += was_reopened ? 1 : 0;
  jumped_in_a_row_ = fix.jumped ? jumped_in_a_row_ + 1 : 0;
  off_in_a_row_ += jumped_in_a_row_ == Statistics::kInARow  ? Statistics::kInARow
                   : jumped_in_a_row_ > Statistics::kInARow ? 1
                                                            : 0;
  if (fix.status == FixStatus::kUsed) {
    nis_ += fix.nis;
    freedom_ += fix.degrees_of_freedom;
    ++judged_;
    for (std::size_t i = 0; i < components_; ++i) {
      squares_[i] += std::pow(fix.innovation[i], 2);
    }
  }
}

void FixSums::put_into(Statistics& statistics) const {
  statistics.fixes = fixes_;
  statistics.fixes_used = used_;
  statistics.fixes_rejected_as_outliers = outliers_;
  statistics.fixes_frozen = frozen_;
  statistics.fixes_off_in_a_row = off_in_a_row_;
  statistics.reopened = reopened_;
  statistics.nis_count = judged_;
  if (judged_ > 0) {
    const auto count = static_cast<double>(judged_);
    statistics.nis_degrees_of_freedom = freedom_ / count;
    statistics.nis_mean = nis_ / count;
    for (std::size_t i = 0; i < components_; ++i) {
      statistics.innovation_rms_rad.push_back(std::sqrt(squares_[i] / count));
    }
  }
}

void add_statistics(const std::vector<FixRecord>& fixes, Statistics& statistics) {
  FixSums sums;
  for (const FixRecord& fix : fixes) {
    sums.add(fix);
  }
  sums.put_into(statistics);
}

void Recorder::add(const StepReport& report, const Pipeline& pipeline) {
  if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
    add_fix(report, pipeline);
  }
  if (report.sample != SampleStatus::kNone) {
    add_sample(report, pipeline);
  }
}

/// What rests on a first fix alone that the next one contradicts: it may have been wrong.
void Recorder::forget_unconfirmed_start() {
  const auto is_confirmed = [](const FixRecord& fix) {
    return fix.used() && fix.status != FixStatus::kStarted && fix.status != FixStatus::kRestarted;
  };
  if (std::ranges::none_of(run_.fixes, is_confirmed)) {
    run_.attitude = {};
    run_.parameters = {};
    run_.corrections.clear();
  }
}

void Recorder::add_fix(const StepReport& report, const Pipeline& pipeline) {
  if (report.fix.status == FixStatus::kRestarted) {
    forget_unconfirmed_start();
  }
  FixRecord& fix = run_.fixes.emplace_back(record_of(report, pipeline.layout().gyros));
  if (report.navigated && report.compared) {
    fix.off_navigator_rad = pipeline.apart_rad(*report.navigated, *report.compared);
  }
  corrected_ = report.corrected ? report.fix.t : corrected_;
  ParameterHistory& parameters = run_.parameters;
  if (report.fix.used() && (parameters.t.empty() || report.fix.t - parameters.t.back() >= ParameterHistory::kStep)) {
    parameters.t.push_back(report.fix.t);
    parameters.value.push_back(parameter_values(pipeline.gyros()));
    const Eigen::VectorXd sigmas = pipeline.state_sigmas();
    parameters.sigma.emplace_back(sigmas.begin(), sigmas.end());
  }
  if (report.fix.used() && report.calibrated &&
      (run_.corrections.empty() || report.fix.t - run_.corrections.back().t >= kWatchedCorrections)) {
    run_.corrections.push_back(correction_of(pipeline, *report.calibrated, report.fix.t));
  }
  if (report.calibrated) {
    append(run_.attitude, report.fix.t, *report.calibrated);
  }
  if (report.navigated) {
    append(run_.navigation, report.fix.t, *report.navigated, corrected_);
  }
}

void GyroEvents::add(const StepReport& report, int gyros, std::vector<GyroEvent>& events) {
  for (int k = 0; k < gyros; ++k) {
    if (report.gyros[k] != before_[k]) {
      events.push_back({report.t, k, report.gyros[k]});
    }
  }
  before_ = report.gyros;
}

void Recorder::add_sample(const StepReport& report, const Pipeline& pipeline) {
  ++run_.samples[report.sample];
  gyros_.add(report, pipeline.layout().gyros, run_.gyro_events);
  long& angle_looks =
      run_.calibration.statistics.angle_looks.emplace(run_.calibration.statistics.angle_looks.value_or(0));
  angle_looks += is_used(report.angles.status) ? 1 : 0;
  run_.fix_counts.lost_to_clock += report.fixes_dropped;
  if (pipeline.started() && report.sample == SampleStatus::kUsed) {
    add_angle(report.t, report.angle_residual);
  }
}

// Keeps the extremes of z1 over each stretch of 3 s.
void Recorder::add_angle(Time t, double residual) {
  if (run_.angle_t.empty() || t - run_.angle_t.back() >= std::chrono::seconds(3)) {
    run_.angle_t.push_back(t);
    run_.angle_residual_min.push_back(residual);
    run_.angle_residual_max.push_back(residual);
    return;
  }
  run_.angle_residual_min.back() = std::min(run_.angle_residual_min.back(), residual);
  run_.angle_residual_max.back() = std::max(run_.angle_residual_max.back(), residual);
}

void CorrectionSums::add(const FixRecord& fix, Duration interval) {
  if (fix.corrected_navigator) {
    ++made_;
    corrected_ = fix.t;
    waiting_since_.reset();
    return;
  }
  if (corrected_ && fix.t - *corrected_ < interval) {
    return;
  }
  waiting_since_ = waiting_since_.value_or(fix.t);
  if (fix.t - *waiting_since_ >= interval) {
    ++missed_;
    waiting_since_ = fix.t;
  }
}

void NavigationRecorder::add(const StepReport& report, const Pipeline& pipeline) {
  if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
    add_fix(report, pipeline);
  }
  if (report.sample != SampleStatus::kNone) {
    gyros_.add(report, pipeline.layout().gyros, run_.gyro_events);
  }
  if (report.sample == SampleStatus::kUsed) {
    if (const std::optional<AttitudeSolution> solution = pipeline.navigation_attitude()) {
      append(run_.attitude, report.t, *solution, corrected_);
    }
  }
  if (report.sample != SampleStatus::kNone && !run_.attitude.t.empty()) {
    ++run_.samples[report.sample];
  }
}

void NavigationRecorder::add_fix(const StepReport& report, const Pipeline& pipeline) {
  const FixRecord& fix = run_.fixes.emplace_back(record_of(report, pipeline.layout().gyros));
  corrections_.add(fix, pipeline.correction_interval());
  if (report.corrected) {
    // All later fixes contradicted the one that started filter and navigator: it was an outlier, which tells nothing of
    // the parameters.
    if (start_unconfirmed_ && fix.status == FixStatus::kUsedAfterReopening) {
      last_compared_.clear();
    }
    corrected_ = fix.t;
    end_open_loop();
  } else if (fix.head == 0 && !fix.jumped && report.navigated && report.compared) {
    if (last_compared_.size() == kLastFixes) {
      last_compared_.erase(last_compared_.begin());
    }
    last_compared_.push_back(pipeline.compare(*report.navigated, *report.compared));
  }
  if (fix.used()) {
    start_unconfirmed_ = fix.status == FixStatus::kStarted;
  }
}

void NavigationRecorder::end_open_loop() {
  if (last_compared_.size() == kLastFixes) {
    const auto median = [&](auto member) {
      const auto middle = last_compared_.begin() + kLastFixes / 2;
      std::ranges::nth_element(last_compared_, middle, {}, member);
      return (*middle).*member;
    };
    const Time t = last_compared_.back().t;
    run_.open_loops.push_back({t, median(&OpenLoopEnd::error_rad), median(&OpenLoopEnd::square)});
  }
  last_compared_.clear();
}

NavigationRun NavigationRecorder::take() && {
  end_open_loop();
  run_.corrections = corrections_.made();
  run_.corrections_missed = corrections_.missed();
  return std::move(run_);
}

}  // namespace trihedron::ground
