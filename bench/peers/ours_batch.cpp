// trihedron's batch over the same pass as the others: ours_batch PASS. The model is that of batch_model.hpp.

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <limits>
#include <variant>

#include "batch/batch.hpp"
#include "flight.hpp"
#include "trihedron/ground/onboard/events.hpp"
#include "trihedron/io/pass.hpp"

namespace {

using namespace trihedron;

constexpr double kCoefficient_rad_s = 2e-6;
constexpr double kAlignment_rad = 8.7e-3;

/// All samples, and all fixes with the sample at their time and the rate of the body there.
ground::ScreenedPass all_of(const Pass& pass) {
  ground::ScreenedPass all(pass.gyro, 2);
  for (std::size_t i = 0; i < pass.gyro.t.size(); ++i) {
    all.samples.add(i, all_gyros(2));
  }
  ground::Events events(pass, 1);
  while (const auto event = events.next()) {
    if (const auto* fix = std::get_if<StarFix>(&*event)) {
      const std::size_t sample = all.samples.from(fix->t);
      ground::ScreenedPass::Fix& its = all.fixes.emplace_back();
      its.fix = *fix;
      its.h_b = all.samples.h_b(sample);
      its.used = all_gyros(2);
      if (all.fixes.size() > 1) {  // by the fixes alone
        const StarFix& before = std::prev(all.fixes.end(), 2)->fix;
        const Eigen::AngleAxisd turn(before.q_in_c.conjugate() * fix->q_in_c);
        its.rate_c = turn.angle() / to_seconds(fix->t - before.t) * turn.axis();
      }
    }
  }
  return all;
}

ground::PassSetup setup_of(double walk_rad_sqrt_s) {
  ground::PassSetup setup;
  setup.on_board = test::nominal_setup();
  setup.on_board.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  const Layout& layout = setup.on_board.layout;
  Eigen::VectorXd variance = Eigen::VectorXd::Constant(layout.parameters(), kCoefficient_rad_s * kCoefficient_rad_s);
  for (int k = 0; k < 2; ++k) {
    setup.prior.gyros[k].drift_rad_s.setZero(layout.drift_columns());
    variance.segment<3>(layout.alignment(k) - layout.dynamic()).setConstant(kAlignment_rad * kAlignment_rad);
  }
  setup.prior.covariance = variance.asDiagonal();
  return setup;
}

/// The best of five.
void measure_and_print(const char* name, const ground::ScreenedPass& pass, const ground::PassSetup& setup) {
  double best = std::numeric_limits<double>::max();
  ground::BatchResult result;
  for (int i = 0; i < 5; ++i) {
    const std::clock_t begin = std::clock();
    const ground::PassProblem problem(pass, setup);
    result = ground::most_likely(problem, problem.start(setup.prior.gyros));
    best = std::min(best, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  const Layout layout = setup.layout();
  std::printf("{\"peer\": \"%s\", \"walk_rad_sqrt_s\": %g, \"seconds\": %.6f, \"iterations\": %d, \"parameters\": [",
              name, setup.on_board.direction_random_walk_rad_sqrt_s, best, result.iterations);
  for (int k = 0; k < 2; ++k) {
    const ground::Gyro& gyro = result.solution.gyros[k];
    const Eigen::Vector3d alignment = Rot<C, C>::assume(gyro.C_c_b).log().raw();
    for (int i = 0; i < Layout::kEq1; ++i) {
      std::printf("%s%.17g", k + i > 0 ? ", " : "", gyro.drift_rad_s(i));
    }
    std::printf(", %.17g, %.17g, %.17g", alignment.x(), alignment.y(), alignment.z());
  }
  std::printf("], \"sigmas\": [");
  for (int i = layout.drift(0); i < layout.size(); ++i) {
    std::printf("%s%.17g", i > layout.drift(0) ? ", " : "", result.errors.last_root.row(i).norm());
  }
  std::printf("]}\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: ours_batch PASS\n", stderr);
    return 2;
  }
  const io::LoadedPass loaded = io::read_pass(argv[1]);
  const ground::ScreenedPass pass = all_of(loaded.pass);
  for (const double walk_rad_sqrt_s : {0.0, 3e-9}) {
    ground::PassSetup setup = setup_of(walk_rad_sqrt_s);
    measure_and_print("trihedron, the batch", pass, setup);
    setup.fixes_together = Duration{0};
    setup.long_step = setup.sample_step;  // as the model has it
    measure_and_print("trihedron, each fix by itself", pass, setup);
  }
}
