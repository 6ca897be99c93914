// Filter and batch on passes made by an independent generator; no part of the product.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <string>
#include <vector>

#include "consistency/statistics.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::consistency {
namespace {

struct SampleWithModel {
  const char* pass;
  const char* drift_model;
  friend std::ostream& operator<<(std::ostream& out, const SampleWithModel& sample) {
    return out << sample.pass << " by " << sample.drift_model;
  }
};
class SamplePass : public testing::TestWithParam<SampleWithModel> {};

INSTANTIATE_TEST_SUITE_P(WithTheModelItAsksFor, SamplePass,
                         testing::Values(SampleWithModel{"pass-a", "esg7"}, SampleWithModel{"pass-b", "esg7"},
                                         SampleWithModel{"pass-c", "esg20"}, SampleWithModel{"pass-d", "esg7"}),
                         [](const auto& name) { return std::string(1, name.param.pass[5]); });

TEST_P(SamplePass, FilterAndBatchAgree) {
  const std::filesystem::path path = std::filesystem::path(TRIHEDRON_SAMPLE_PASSES) / GetParam().pass;
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no sample passes here";
  }
  const Pass pass = io::read_pass(path).pass;
  CalibrationOptions options;
  options.drift_model = GetParam().drift_model;
  const Calibration by_filter = ground::calibrate(pass, options).calibration;
  options.estimator = ground::kBatch;
  const Calibration by_batch = ground::calibrate(pass, options).calibration;
  EXPECT_EQ(by_filter.states, by_batch.states);

  std::vector<std::string> states = ground::common_states(by_batch, by_filter, false);
  std::ranges::copy(ground::common_states(by_batch, by_filter, true), std::back_inserter(states));
  const Eigen::VectorXd apart = ground::difference(by_batch, by_filter, states);
  const auto size = static_cast<double>(states.size());
  Difference mean;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double sigma = ground::sigma_of(by_batch, states[i]);
    mean.square += std::pow(apart(static_cast<Eigen::Index>(i)) / sigma, 2) / size;
    mean.variance_ratio += std::pow(ground::sigma_of(by_filter, states[i]) / sigma, 2) / size;
  }
  EXPECT_TRUE(agrees(mean)) << std::sqrt(mean.square) << " sigma apart, ratio of the sigmas "
                            << std::sqrt(mean.variance_ratio);
}

}  // namespace
}  // namespace trihedron::consistency
