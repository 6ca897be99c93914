// Filter and batch on passes of each kind.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "consistency/statistics.hpp"
#include "sample_passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::consistency {
namespace {

class SamplePass : public testing::TestWithParam<PassOfKind> {};

INSTANTIATE_TEST_SUITE_P(WithTheModelItAsksFor, SamplePass,
                         testing::ValuesIn(sample_passes({PassKind::kNominal, PassKind::kSteadyFlight, PassKind::kDirty,
                                                          PassKind::kYawManoeuvre})),
                         [](const auto& pass) { return pass.param.identifier(); });

DriftModelId drift_model_for(PassKind kind) { return kind == PassKind::kDirty ? kEsg20 : kEsg7; }

TEST_P(SamplePass, FilterAndBatchAgree) {
  const Pass pass = io::read_pass(GetParam().path).pass;
  CalibrationOptions options;
  options.drift_model = drift_model_for(GetParam().kind);
  const Calibration by_filter = ground::calibrate(pass, options).calibration;
  options.estimator = Estimator::kBatch;
  const Calibration by_batch = ground::calibrate(pass, options).calibration;
  EXPECT_EQ(by_filter.states, by_batch.states);

  std::vector<ParameterId> states = ground::common_states(by_batch, by_filter, false);
  std::ranges::copy(ground::common_states(by_batch, by_filter, true), std::back_inserter(states));
  const Eigen::VectorXd apart = ground::difference(by_batch, by_filter, states);
  const auto size = static_cast<double>(states.size());
  Difference mean;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double sigma = sigma_of(by_batch, states[i]);
    mean.square += std::pow(apart(static_cast<Eigen::Index>(i)) / sigma, 2) / size;
    mean.variance_ratio += std::pow(sigma_of(by_filter, states[i]) / sigma, 2) / size;
  }
  EXPECT_TRUE(agrees(mean)) << std::sqrt(mean.square) << " sigma apart, ratio of the sigmas "
                            << std::sqrt(mean.variance_ratio);
}

}  // namespace
}  // namespace trihedron::consistency
