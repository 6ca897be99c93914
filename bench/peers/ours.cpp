// trihedron's filters over the same pass as the others: ours PASS. The model of the paper's is that of the others.

#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

#include "flight.hpp"
#include "trihedron/ground/onboard/events.hpp"
#include "trihedron/io/pass.hpp"

namespace {

using namespace trihedron;

template <class Estimator>
void measure_and_print(const char* name, const std::vector<GyroSample>& samples, const std::vector<StarFix>& fixes) {
  test::Given<Estimator> given;
  given.set_alignment_sigma(8.7e-3);
  const auto estimator = std::make_unique<Estimator>();
  double best = std::numeric_limits<double>::max();
  long used = 0;
  for (int times = 0; times < 5; ++times) {
    TRIHEDRON_ASSERT(!estimator->set_up(given.setup, given.prior, given.covariance));
    used = 0;
    FixReadings readings;
    readings.used = all_gyros(2);
    const std::clock_t begin = std::clock();
    auto fix = fixes.begin();
    for (const GyroSample& sample : samples) {
      if (estimator->started()) {
        const auto C_in_c = estimator->rotation(estimator->gyros(), sample.h_b, readings.used);
        estimator->predict(C_in_c.value().raw(), sample.h_b, sample.t, 0.125);
      }
      if (fix != fixes.end() && fix->t <= sample.t) {
        readings.h_b = sample.h_b;
        used += estimator->correct(*fix++, readings).status == FixStatus::kUsed ? 1 : 0;
      }
    }
    best = std::min(best, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  const Layout errors = estimator->error_layout();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root(errors.size(), estimator->states());
  estimator->error_root({root.data(), errors.size(), estimator->states(), estimator->states()});
  std::printf("{\"peer\": \"%s\", \"seconds\": %.6f, \"fixes_used\": %ld, \"parameters\": [", name, best, used);
  for (int k = 0; k < 2; ++k) {
    const auto& gyro = estimator->gyros()[k];
    const Eigen::Vector3d alignment = Rot<C, C>::assume(gyro.C_c_b).log().raw();
    for (int i = 0; i < Layout::kEq1; ++i) {
      std::printf("%s%.17g", k + i > 0 ? ", " : "", gyro.drift_rad_s(i));
    }
    std::printf(", %.17g, %.17g, %.17g", alignment.x(), alignment.y(), alignment.z());
  }
  std::printf("], \"sigmas\": [");
  for (int i = errors.drift(0); i < errors.size(); ++i) {
    std::printf("%s%.17g", i > errors.drift(0) ? ", " : "", root.row(i).norm());
  }
  std::printf("]}\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: ours PASS\n", stderr);
    return 2;
  }
  const io::LoadedPass loaded = io::read_pass(argv[1]);
  std::vector<GyroSample> samples;
  std::vector<StarFix> fixes;
  ground::Events events(loaded.pass, 1);
  while (const auto event = events.next()) {
    if (const auto* sample = std::get_if<GyroSample>(&*event)) {
      samples.push_back(*sample);
      for (int k = 0; k < 2; ++k) {
        samples.back().h_b[k].normalize();
      }
    } else {
      fixes.push_back(std::get<StarFix>(*event));
    }
  }
  measure_and_print<PaperEstimator>("trihedron, the filter of the paper", samples, fixes);
  measure_and_print<test::PairEstimator>("trihedron, the default filter", samples, fixes);
}
