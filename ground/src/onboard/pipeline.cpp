#include "trihedron/ground/onboard/pipeline.hpp"

#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "model/open_loop_start.hpp"
#include "model/orbital_rate.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "onboard/calibration_of.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/on_board.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

SetupError error_of(SetupFault fault) {
  switch (fault) {
    case SetupFault::kPriorNotPositiveDefinite:
      return {"the prior covariance is not positive definite",
              "give each parameter a prior sigma above zero, and correlations below one"};
    case SetupFault::kPriorMeanNotUsable:
      return {"a prior mean is not finite, or an alignment is not a rotation", "correct the prior"};
    case SetupFault::kNoiseNotPositive:
      return {"a noise sigma is not positive",
              "give positive readout and star-tracker noise, and process noise of zero or more"};
    case SetupFault::kGateNotPositive:
      return {"the gate or a number of rejections before reopening is not positive", "give positive numbers"};
    case SetupFault::kTooLarge:
      break;
  }
  return {"there are more states than there is room for", "use fewer gyros, or a smaller drift model"};
}

template <class OnBoard>
StepReport give(OnBoard& on_board, const GyroSample& sample) {
  return on_board.on_gyro(sample);
}
template <class OnBoard>
StepReport give(OnBoard& on_board, const StarFix& fix) {
  return on_board.on_fix(fix);
}

/// Of the fixes: when the rate of the orbit is told first, and last, each time after twice the time before.
constexpr Duration kFirstLookAtOrbit = std::chrono::minutes(20);
constexpr Duration kLastLookAtOrbit = std::chrono::minutes(320);
/// A hundredth of an error at orbital period.
constexpr double kPhaseThatMatters_rad = 0.01;
/// More than samples and fixes until the last look; with stamps that stand still it does not come.
constexpr std::size_t kMostEvents = 500'000;

}  // namespace

struct Pipeline::Program {
  using Paper = OnBoard<PaperEstimator>;
  std::variant<std::unique_ptr<FullOnBoard>, std::unique_ptr<Paper>> on_board;
  Layout layout;
  Prior prior;

  template <class Body>
  auto visit(Body&& body) const {
    return std::visit([&](const auto& its) { return body(*its); }, on_board);
  }

  template <class Type>
  void set_up(const CalibrationSetup& setup, const CorrectionPolicy& policy) {
    auto its = std::make_unique<Type>();
    if (const auto fault =
            its->set_up(setup, with_room<typename Type::Gyros>(prior.gyros, layout), prior.covariance, policy)) {
      throw error_of(*fault);
    }
    on_board = std::move(its);
  }

  [[nodiscard]] Gyros gyros() const {
    return visit([&](const auto& its) { return with_room<Gyros>(its.estimator().gyros(), layout); });
  }
};

std::unique_ptr<InvariantEstimator<kPairCapacity>> pair_estimator(const PassSettings& settings,
                                                                  const CalibrationOptions& options) {
  const CalibrationSetup setup = setup_of(settings, options);
  if (!(setup.layout == Layout{})) {
    throw std::invalid_argument("pair_estimator: not two gyros with eq. (1) alone");
  }
  const Prior prior = prior_of(settings, setup.layout);
  auto estimator = std::make_unique<InvariantEstimator<kPairCapacity>>();
  using PairGyros = InvariantEstimator<kPairCapacity>::Gyros;
  if (const auto fault = estimator->set_up(setup, with_room<PairGyros>(prior.gyros, setup.layout), prior.covariance)) {
    throw error_of(*fault);
  }
  return estimator;
}

Pipeline::Pipeline(const PassSettings& settings, const CalibrationOptions& options, Steps steps, bool navigate)
    : settings_(settings), options_(options), policy_(policy_of(options.corrections)) {
  policy_.navigate = navigate;
  policy_.steps_over_samples = steps == Steps::kOverSamples;
  set_up();
  const FurtherStates& further = layout().further;
  if ((further.orbital_error || further.orbital_drift) && !options.orbital_rate_rad_s) {
    orbit_.emplace().next = kFirstLookAtOrbit;
  }
}

void Pipeline::set_up() {
  program_ = std::make_unique<Program>();
  const CalibrationSetup setup = setup_of(settings_, options_);
  program_->layout = setup.layout;
  program_->prior = prior_of(settings_, setup.layout);
  if (options_.estimator == Estimator::kPaper) {
    program_->set_up<Program::Paper>(setup, policy_);
  } else {
    program_->set_up<FullOnBoard>(setup, policy_);
  }
}

Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

std::span<const StepReport> Pipeline::feed(const GyroSample& sample) {
  if (orbit_) {
    look_at_orbit();
  }
  const std::span<const StepReport> reports = report_all([&](auto& on_board) { return give(on_board, sample); });
  if (orbit_) {
    keep(sample, reports.front().sample);
  }
  return reports;
}

std::span<const StepReport> Pipeline::feed(const StarFix& fix) {
  if (orbit_) {
    look_at_orbit();
  }
  if (orbit_) {
    keep(fix);
  }
  return report_all([&](auto& on_board) { return give(on_board, fix); });
}

/// Before an event is dealt with: that the rate is known better by now, and then what came before is flown again.
void Pipeline::look_at_orbit() {
  const StarTrackerTelemetry& fixes = orbit_->fixes;
  const Duration passed = fixes.size() > 0 ? fixes.t.back() - fixes.t.front() : Duration::zero();
  const bool is_long = orbit_->latest && *orbit_->latest - *orbit_->first > kLastLookAtOrbit;
  const bool is_last = is_long || orbit_->events.size() >= kMostEvents;
  if (passed <= orbit_->next && !is_last) {
    return;
  }
  const std::optional<double> so_far_rad_s = orbital_rate_so_far_rad_s(fixes);
  if (so_far_rad_s && is_another_rate(*so_far_rad_s, passed)) {
    options_.orbital_rate_rad_s = so_far_rad_s;
    set_up();
    for (const auto& before : orbit_->events) {
      std::visit(
          [&](const auto& its) { static_cast<void>(report_all([&](auto& on_board) { return give(on_board, its); })); },
          before);
    }
  }
  while (orbit_->next < passed) {
    orbit_->next *= 2;
  }
  if (is_last) {
    orbit_.reset();
  }
}

/// Whether it matters over that time. What an earlier calibration found is better than what a short time tells, but for
/// that of another orbit.
bool Pipeline::is_another_rate(double rate_rad_s, Duration passed) const {
  constexpr double kAnotherOrbit = 0.03;
  const double before_rad_s = setup_of(settings_, options_).orbital_rate_rad_s;
  const bool is_of_calibration =
      !options_.orbital_rate_rad_s && settings_.prior && settings_.prior->orbital_rate_rad_s.has_value();
  const double off_rad_s = std::abs(rate_rad_s - before_rad_s);
  return off_rad_s * to_seconds(passed) > kPhaseThatMatters_rad &&
         (!is_of_calibration || passed > kLongForOrbitalRate || off_rad_s > kAnotherOrbit * std::abs(before_rad_s));
}

void Pipeline::keep(const GyroSample& sample, SampleStatus status) {
  if (status == SampleStatus::kThinned) {
    return;
  }
  // Times before and after have nothing in common.
  if (status == SampleStatus::kUsedAfterClockSetBack) {
    orbit_.reset();
    return;
  }
  if (status != SampleStatus::kRejectedOutOfOrder) {
    orbit_->first = orbit_->first.value_or(sample.t);
    orbit_->latest = sample.t;
  }
  orbit_->events.emplace_back(sample);
}

void Pipeline::keep(const StarFix& fix) {
  constexpr Duration kNear = std::chrono::minutes(1);
  StarTrackerTelemetry& fixes = orbit_->fixes;
  if (orbit_->latest && std::chrono::abs(fix.t - *orbit_->latest) < kNear && fix.head == 0 &&
      nearly_unit(fix.q_in_c.norm()) && (fixes.t.empty() || fix.t > fixes.t.back())) {
    fixes.t.push_back(fix.t);
    fixes.q_in_c.push_back(fix.q_in_c.normalized());
  }
  orbit_->events.emplace_back(fix);
}

// A step deals with one fix at most: goes on while another is due.
template <class Step>
std::span<const StepReport> Pipeline::report_all(const Step& step) {
  reports_.clear();
  std::visit(
      [&](auto& its) {
        reports_.push_back(step(*its));
        while (reports_.back().more_due) {
          reports_.push_back(its->carry_on());
        }
      },
      program_->on_board);
  return reports_;
}

std::span<const StepReport> Pipeline::finish() {
  reports_.clear();
  std::visit(
      [&](auto& its) {
        for (StepReport report = its->flush(); report.fix.status != FixStatus::kNone; report = its->flush()) {
          reports_.push_back(report);
        }
      },
      program_->on_board);
  return reports_;
}

const Layout& Pipeline::layout() const { return program_->layout; }

Duration Pipeline::correction_interval() const { return policy_of(options_.corrections).interval; }

bool Pipeline::started() const {
  return program_->visit([](const auto& its) { return its.estimator().started(); });
}

Time Pipeline::t() const {
  return program_->visit([](const auto& its) { return its.t(); });
}

double Pipeline::part_of_change() const {
  return program_->visit([&](const auto& its) { return its.estimator().setup().part_of_change(t()); });
}

std::vector<GyroCalibration> Pipeline::gyros() const {
  return program_->visit(
      [&](const auto& its) { return records_of(its.estimator().gyros(), its.estimator().setup(), part_of_change()); });
}

std::vector<GyroCalibration> Pipeline::gyros_before() const {
  return records_of(program_->prior.gyros, setup_of(settings_, options_), 0);
}

Eigen::VectorXd Pipeline::state_sigmas() const {
  return program_->visit([&](const auto& its) -> Eigen::VectorXd {
    return parameter_root(its.estimator(), part_of_change()).rowwise().norm();
  });
}

Calibration Pipeline::calibration() const {
  Calibration result = program_->visit([&](const auto& its) { return calibration_of(its, settings_.epoch); });
  result.estimator = options_.estimator;
  if (layout().further.orbital_error) {
    result.orbital_rate_rad_s = setup_of(settings_, options_).orbital_rate_rad_s;
  }
  result.noise->star_tracker_noise_rad = options_.star_tracker_noise_rad;
  if (layout().further.wandering_drift) {
    result.noise->wandering_drift_rad_s = options_.further_states.wandering_drift_rad_s;
    result.noise->wandering_time_s = to_seconds(options_.further_states.wandering_time);
  }
  return result;
}

OpenLoopStart Pipeline::errors() const {
  return program_->visit([&](const auto& its) {
    const auto& estimator = its.estimator();
    const Layout layout = estimator.error_layout();
    OpenLoopStart start =
        open_loop_start(estimator.setup(), layout, program_->gyros(), error_covariance(estimator, part_of_change()));
    start.change.zero_at = t();
    return start;
  });
}

Pipeline::Held Pipeline::held_at(const Rot<In, C>& C_in_c, const Eigen::Matrix3d& covariance_rad2) const {
  const Gyros estimated = program_->gyros();
  Gyros held = program_->prior.gyros;
  for (int k = 0; k < layout().gyros; ++k) {
    // What the gyro reads is told by the estimates.
    const Eigen::Vector3d h_b = estimated[k].reading_of(C_in_c.raw().transpose() * estimated[k].h_in);
    held[k].h_in = (C_in_c.raw() * held[k].in_c(h_b)).normalized();
  }
  const CalibrationSetup setup = setup_of(settings_, options_);
  return {records_of(held, setup, 0),
          start_with_held_parameters(setup, held, program_->prior.covariance, C_in_c.raw(), covariance_rad2)};
}

auto Pipeline::distances_from_prior() const -> std::array<DistanceFromPrior, 3> {
  const Gyros gyros = program_->gyros();
  Eigen::VectorXd moved(layout().parameters());
  std::vector<Eigen::Index> alignments;
  std::vector<Eigen::Index> of_eq1;
  for (int k = 0; k < layout().gyros; ++k) {
    const Gyro& held = program_->prior.gyros[k];
    const int row = layout().drift(k) - layout().drift(0);
    moved.segment(row, layout().drift_size()) =
        gyros[k].drift_rad_s.head(layout().drift_size()) - held.drift_rad_s.head(layout().drift_size());
    moved.segment<3>(row + layout().drift_size()) =
        Rot<C, C>::assume(Eigen::Matrix3d(gyros[k].C_c_b * held.C_c_b.transpose())).log().raw();
    for (int i = 0; i < 3; ++i) {
      alignments.push_back(row + layout().drift_size() + i);
    }
    for (int i = 0; i < Layout::kEq1; ++i) {
      of_eq1.push_back(row + i);
    }
  }
  std::vector<Eigen::Index> all(static_cast<std::size_t>(moved.size()));
  std::iota(all.begin(), all.end(), 0);
  const auto distance = [&](std::string_view of, const std::vector<Eigen::Index>& states) {
    const Eigen::VectorXd its = moved(states);
    const Eigen::MatrixXd P = program_->prior.covariance(states, states);
    return DistanceFromPrior{of, its.dot(P.llt().solve(its)), static_cast<int>(states.size())};
  };
  return {distance("all parameters", all), distance("the alignments", alignments),
          distance("the coefficients of eq. (1)", of_eq1)};
}

Eigen::Vector3d Pipeline::apart_rad(const AttitudeSolution& attitude, const ComparedFix& its) const {
  return program_->visit([&](const auto& on_board) -> Eigen::Vector3d {
    const auto& estimator = on_board.estimator();
    Rot<In, C> by_fix = Rot<In, C>::assume(its.fix.q_in_c.normalized());
    if constexpr (requires { estimator.shared(); }) {
      const FixBySharedStates by_shared = fix_by_shared_states(estimator.setup(), its.fix, its.readings.rate_c);
      by_fix = corrected(its.fix, by_shared.lazyProduct(estimator.shared()));
    }
    return (attitude.C_in_c.inverse() * by_fix).log().raw();
  });
}

OpenLoopEnd Pipeline::compare(const AttitudeSolution& attitude, const ComparedFix& its) const {
  return program_->visit([&](const auto& on_board) {
    const Eigen::Vector3d apart = apart_rad(attitude, its);
    const Eigen::Matrix3d covariance = attitude.covariance_rad2 + fix_noise(on_board.estimator().setup(), its.fix);
    return OpenLoopEnd{its.fix.t, apart.norm(), apart.dot(covariance.llt().solve(apart))};
  });
}

std::optional<AttitudeSolution> Pipeline::navigation_attitude() const {
  return program_->visit([](const auto& its) -> std::optional<AttitudeSolution> {
    if (!its.navigator().started()) {
      return std::nullopt;
    }
    const auto solution = its.navigation_attitude();
    return solution ? std::optional(solution.value()) : std::nullopt;
  });
}

}  // namespace trihedron::ground
