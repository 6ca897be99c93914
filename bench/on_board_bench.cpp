// The on-board cycle against a dense 24-state covariance propagated at every 8 Hz sample: the ratio of the two is the
// claim.

#include <benchmark/benchmark.h>

#include "flight.hpp"
#include "trihedron/core/cycles.hpp"

namespace {

using namespace trihedron;
using Estimator = PaperEstimator<Esg7>;

const test::Flight& flight() {
  static const test::Flight one_hour({.duration_s = 3600});
  return one_hour;
}

/// Whole on-board step: prediction with sensitivities, filter at every fix, open-loop navigator beside it.
void whole_cycle(benchmark::State& state) {
  for (auto _ : state) {
    auto cycle = Cycle<Estimator>::create(test::nominal_setup(), {}).value();
    test::fly(flight(), cycle, [](const auto& report) { benchmark::DoNotOptimize(report); });
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(flight().samples.size()));
}

/// The filter alone: prediction with sensitivities, square-root information update at every fix.
void filter_alone(benchmark::State& state) {
  for (auto _ : state) {
    auto estimator = Estimator::create(test::nominal_setup()).value();
    std::size_t fix = 0;
    for (std::size_t i = 0; i < flight().samples.size(); ++i) {
      const auto& h_b = flight().samples[i].h_b;
      if (estimator.started()) {
        estimator.predict(PaperEstimator<Esg7>::attitude(estimator.gyros(), h_b).value().C_in_c.raw(), h_b, 0.125);
      }
      if (fix < flight().fixes.size() && flight().fixes[fix].t <= flight().samples[i].t) {
        benchmark::DoNotOptimize(estimator.correct(flight().fixes[fix].q_in_c.toRotationMatrix(), h_b));
        ++fix;
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(flight().samples.size()));
}

/// The straightforward filter: the same model, P ← F P Fᵀ + Q with full 24 × 24 matrices at each sample, and a full
/// update at each fix.
void dense_covariance_at_8_hz(benchmark::State& state) {
  constexpr int kN = Estimator::Layout::kStates;
  using Matrix = Eigen::Matrix<double, kN, kN>;
  for (auto _ : state) {
    const auto setup = test::nominal_setup();
    Estimator::Gyros gyros = test::Flight({.duration_s = 1}).truth;
    Matrix P = Matrix::Identity() * 1e-6;
    std::size_t fix = 0;
    for (const auto& sample : flight().samples) {
      const Eigen::Matrix3d C_in_c = PaperEstimator<Esg7>::attitude(gyros, sample.h_b).value().C_in_c.raw();
      const auto qi = Estimator::quasi_inertial(
          make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in)).value());
      Matrix F = Matrix::Identity();
      for (int k = 0; k < 2; ++k) {
        Sensitivity<Esg7> step;
        precess(gyros[k], step, C_in_c, sample.h_b[k], 0.125);
        const Eigen::Matrix<double, 2, 3> components = -qi.components[k] * skew<double>(gyros[k].h_in);
        const int row = Estimator::Layout::direction(k);
        F.block<2, 7>(row, Estimator::Layout::drift(k)) = components * step.by_drift;
        F.block<2, 3>(row, Estimator::Layout::alignment(k)) = components * step.by_alignment;
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
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(flight().samples.size()));
}

BENCHMARK(whole_cycle)->Unit(benchmark::kMillisecond);
BENCHMARK(filter_alone)->Unit(benchmark::kMillisecond);
BENCHMARK(dense_covariance_at_8_hz)->Unit(benchmark::kMillisecond);

}  // namespace
