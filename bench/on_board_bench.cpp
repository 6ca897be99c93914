// The on-board step: of the default estimator, of the paper's, its parts, and against a dense 24-state covariance that
// is propagated at every 8 Hz sample. One hour of two gyros at 8 Hz and fixes each 3 s; the ratios are the claim.

#include <benchmark/benchmark.h>

#include <Eigen/LU>

#include "flight.hpp"

namespace {

using namespace trihedron;

const test::Flight& flight() {
  static const test::Flight one_hour({.duration_s = 3600});
  return one_hour;
}

void count_samples(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(flight().samples.size()));
}

/// The whole on-board step: prediction with sensitivities, filter at every fix, open-loop navigator beside it.
template <class Estimator>
void whole_step(benchmark::State& state, bool navigate) {
  const test::Given<Estimator> given;
  const auto on_board = std::make_unique<OnBoard<Estimator>>();
  for (auto _ : state) {
    benchmark::DoNotOptimize(on_board->set_up(given.setup, given.prior, given.covariance, {.navigate = navigate}));
    test::fly(flight(), *on_board, [](const StepReport& report) { benchmark::DoNotOptimize(report); });
  }
  count_samples(state);
}

/// The filter alone: attitude and prediction with sensitivities at every sample, update at every fix.
template <class Estimator>
void filter_alone(benchmark::State& state) {
  const test::Given<Estimator> given;
  const auto estimator = std::make_unique<Estimator>();
  FixReadings readings;
  readings.used = all_gyros(2);
  for (auto _ : state) {
    benchmark::DoNotOptimize(estimator->set_up(given.setup, given.prior, given.covariance));
    std::size_t fix = 0;
    for (const GyroSample& sample : flight().samples) {
      if (estimator->started()) {
        const auto C_in_c = estimator->rotation(estimator->gyros(), sample.h_b, readings.used);
        estimator->predict(C_in_c.value().raw(), sample.h_b, sample.t, 0.125);
      }
      if (fix < flight().fixes.size() && flight().fixes[fix].t <= sample.t) {
        readings.h_b = sample.h_b;
        benchmark::DoNotOptimize(estimator->correct(flight().fixes[fix], readings));
        ++fix;
      }
    }
  }
  count_samples(state);
}

/// An estimator that has been through the flight, and what it was compared with last.
template <class Estimator>
struct Flown {
  std::unique_ptr<OnBoard<Estimator>> on_board = test::Given<Estimator>().on_board();
  Estimator estimator;
  ComparedFix compared;
  Eigen::Matrix3d C_in_c;

  Flown() {
    test::fly(flight(), *on_board,
              [&](const StepReport& report) { compared = report.compared ? *report.compared : compared; });
    estimator = on_board->estimator();
    C_in_c = compared.fix.q_in_c.toRotationMatrix();
  }
};

/// The momenta and their sensitivities over one step.
template <class Estimator>
void prediction(benchmark::State& state) {
  Flown<Estimator> flown;
  Time t = flown.compared.fix.t;
  for (auto _ : state) {
    t += std::chrono::milliseconds(125);
    flown.estimator.predict(flown.C_in_c, flown.compared.readings.h_b, t, 0.125);
  }
}

/// The update by one fix, again and again the same.
template <class Estimator>
void fix(benchmark::State& state) {
  Flown<Estimator> flown;
  for (auto _ : state) {
    flown.compared.fix.t += std::chrono::seconds(3);
    flown.estimator.predict(flown.C_in_c, flown.compared.readings.h_b, flown.compared.fix.t, 3);
    for (int k = 0; k < 2; ++k) {
      const auto& gyro = flown.estimator.gyros()[k];
      flown.compared.readings.h_b[k] = gyro.reading_of(flown.C_in_c.transpose() * gyro.h_in);
    }
    benchmark::DoNotOptimize(flown.estimator.correct(flown.compared.fix, flown.compared.readings));
  }
}

/// The attitude of a step, from its readings.
template <class Estimator>
void attitude_of_step(benchmark::State& state) {
  const Flown<Estimator> flown;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        flown.estimator.rotation(flown.estimator.gyros(), flown.compared.readings.h_b, flown.compared.readings.used));
  }
}

/// The navigator's attitude with its covariance, at the latest sample.
template <class Estimator>
void navigation_attitude(benchmark::State& state) {
  const Flown<Estimator> flown;
  for (auto _ : state) {
    benchmark::DoNotOptimize(flown.on_board->navigation_attitude());
  }
}

/// The straightforward filter: the same model, P ← F P Fᵀ + Q with full 24 × 24 matrices at each sample, and a full
/// update at each fix.
void dense_covariance_at_8_hz(benchmark::State& state) {
  using Estimator = PaperEstimator;
  constexpr int kN = Estimator::States::kSize;
  using Matrix = Eigen::Matrix<double, kN, kN>;
  const CalibrationSetup setup = test::nominal_setup();
  const DriftModel drift;
  const Estimator estimator;
  const GyroMask both = all_gyros(2);
  for (auto _ : state) {
    Estimator::Gyros gyros = test::Flight({.duration_s = 1}).truth;
    Matrix P = Matrix::Identity() * 1e-6;
    std::size_t fix = 0;
    for (const GyroSample& sample : flight().samples) {
      const Eigen::Matrix3d C_in_c = estimator.rotation(gyros, sample.h_b, both).value().raw();
      const auto qi = Estimator::quasi_inertial(
          make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in)).value());
      Matrix F = Matrix::Identity();
      for (int k = 0; k < 2; ++k) {
        Sensitivity<Esg7::kSize> step;
        precess(gyros[k], step, drift, C_in_c, sample.h_b[k], {}, 0.125);
        const Eigen::Matrix<double, 2, 3> components = -qi.components[k] * skew<double>(gyros[k].h_in);
        const int row = Estimator::States::direction(k);
        F.block<2, 7>(row, Estimator::States::drift(k)) = components.lazyProduct(step.by_drift.first(Esg7::kSize));
        F.block<2, 3>(row, Estimator::States::alignment(k)) = components * step.by_alignment;
      }
      P = (F * P * F.transpose()).eval();
      if (fix < flight().fixes.size() && flight().fixes[fix].t <= sample.t) {
        const auto m = Estimator::measure(gyros, qi, flight().fixes[fix].q_in_c.toRotationMatrix(), sample.h_b, setup);
        const Eigen::Matrix<double, kN, 4> PHt = P * m.H.transpose();
        const Eigen::Matrix4d S = m.H * PHt + m.R;
        const Eigen::Matrix<double, kN, 4> K = PHt * S.inverse();
        P = (P - K * PHt.transpose()).eval();
        P = (0.5 * (P + P.transpose())).eval();
        benchmark::DoNotOptimize(P);
        ++fix;
      }
    }
  }
  count_samples(state);
}

using Invariant = test::PairEstimator;
using Everything = test::FullEstimator;

void whole_step_invariant(benchmark::State& state) { whole_step<Invariant>(state, true); }
void whole_step_invariant_in_full_capacity(benchmark::State& state) { whole_step<Everything>(state, true); }
void whole_step_invariant_without_navigator(benchmark::State& state) { whole_step<Invariant>(state, false); }
void whole_step_paper(benchmark::State& state) { whole_step<PaperEstimator>(state, true); }

BENCHMARK(whole_step_invariant)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_step_invariant_in_full_capacity)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_step_invariant_without_navigator)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_step_paper)->Unit(benchmark::kMillisecond);
BENCHMARK(filter_alone<Invariant>)->Unit(benchmark::kMillisecond);
BENCHMARK(filter_alone<PaperEstimator>)->Unit(benchmark::kMillisecond);
BENCHMARK(dense_covariance_at_8_hz)->Unit(benchmark::kMillisecond);
BENCHMARK(attitude_of_step<Invariant>);
BENCHMARK(prediction<Invariant>);
BENCHMARK(fix<Invariant>);
BENCHMARK(navigation_attitude<Invariant>);
BENCHMARK(attitude_of_step<PaperEstimator>);
BENCHMARK(prediction<PaperEstimator>);
BENCHMARK(fix<PaperEstimator>);
BENCHMARK(navigation_attitude<PaperEstimator>);

}  // namespace
