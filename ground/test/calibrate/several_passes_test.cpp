#include "trihedron/ground/calibrate/several_passes.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "passes.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using boost::math::chi_squared;
using boost::math::quantile;
using std::chrono::hours;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

/// A pass `later` than two_hours(), with the gyros as `truth` has them.
Scenario with_gyros_of(const Truth& truth, std::uint64_t seed, Duration later) {
  return ground::with_gyros_of(truth, scenario_in_eq1(seed, hours(2)), later);
}

const sim::SimulatedPass& of_the_same_start_up() {
  static const sim::SimulatedPass simulated = sim::simulate(with_gyros_of(two_hours().truth, 6, hours(9)));
  return simulated;
}

SeveralPasses after_two_hours_and(const Pass& second) {
  SeveralPasses passes(told());
  passes.add("first", two_hours().pass);
  passes.add("second", second);
  return passes;
}

/// One of the two has more members than an estimator on board: what makes up for these is compared.
TEST(SeveralPasses, WithADriftFieldAgreeByWhatIsFlownOnBoard) {
  const auto with_field = [](Scenario scenario) {
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.harmonics.push_back({DriftHarmonic::Potential::kW, 1, 1, 4e-8});
    }
    return scenario;
  };
  const sim::SimulatedPass first = sim::simulate(with_field(scenario_in_eq1(5, hours(2))));
  const sim::SimulatedPass second = sim::simulate(with_field(with_gyros_of(first.truth, 6, hours(9))));
  CalibrationOptions options = told();
  options.drift_model.reset();
  SeveralPasses passes(options);
  passes.add("first", first.pass);
  const PassAlone& later = passes.add("second", second.pass);
  EXPECT_TRUE(later.coefficients.holds()) << later.coefficients.text();
  EXPECT_TRUE(later.alignments.holds()) << later.alignments.text();
  EXPECT_GT(later.alignments.degrees_of_freedom, 0);
  const Calibration& together = passes.combined().calibration;
  EXPECT_EQ(together.gyros.at(0).drift_model, kLargestDriftModel);
  ASSERT_TRUE(together.on_board_drift);
  EXPECT_EQ(together.states.size(), static_cast<std::size_t>(together.covariance.rows()));
  EXPECT_FALSE(together.drift_field.empty());
}

/// The prior of the members of a field is found from each pass.
TEST(SeveralPasses, OfABatchWithADriftFieldAreComparedByEq1AndAlignments) {
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  options.drift_model.reset();
  SeveralPasses passes(options);
  passes.add("first", two_hours().pass);
  const PassAlone second = passes.add("second", of_the_same_start_up().pass);
  EXPECT_EQ(passes.combined().calibration.gyros.at(0).drift_model, kLargestDriftModel);
  EXPECT_TRUE(second.coefficients.holds()) << second.coefficients.text();
  EXPECT_TRUE(second.alignments.holds()) << second.alignments.text();
  EXPECT_GT(second.coefficients.degrees_of_freedom, 10);
  EXPECT_EQ(second.alignments.degrees_of_freedom, 6);
  EXPECT_TRUE(passes.combined().calibration.verdict.trustworthy);

  Scenario other = with_gyros_of(two_hours().truth, 7, hours(18));
  for (GyroScenario& gyro : other.gyros) {
    gyro.drift.kappa_rad_s.reset();
  }
  const PassAlone third = passes.add("third", sim::simulate(other).pass);
  EXPECT_FALSE(third.coefficients.holds()) << third.coefficients.text();
  EXPECT_FALSE(passes.combined().calibration.verdict.trustworthy);
}

auto has_finding(FindingCode code) { return Contains(Field(&Finding::code, code)); }

std::string refusal_of(const Pass& second) {
  SeveralPasses passes(told());
  Pass first = two_hours().pass;
  first.settings.start_up = "May";
  passes.add("first", first);
  try {
    passes.add("second", second);
  } catch (const SetupError& error) {
    return error.what();
  }
  return {};
}

TEST(SeveralPasses, OfOneStartUpAgreeAndAreBetterThanOne) {
  const SeveralPasses passes = after_two_hours_and(of_the_same_start_up().pass);
  const PassAlone& second = passes.passes().at(1);
  EXPECT_TRUE(second.coefficients.holds());
  EXPECT_TRUE(second.alignments.holds());
  EXPECT_GT(second.coefficients.degrees_of_freedom, 10);
  EXPECT_EQ(second.alignments.degrees_of_freedom, 6);
  const Calibration& combined = passes.combined().calibration;
  EXPECT_EQ(combined.epoch, of_the_same_start_up().pass.settings.epoch);
  EXPECT_LT(nees_of(two_hours().truth, combined), 45);  // χ² of 20, once in 1000
  for (const PassAlone& pass : passes.passes()) {
    EXPECT_LT(nees_of(two_hours().truth, pass.run.calibration), 45);
    for (const ParameterId& state : combined.states) {
      EXPECT_LT(sigma_of(combined, state), sigma_of(pass.run.calibration, state)) << name_of(state);
    }
  }
  // The prior counts once. That each pass is linearised about its own estimate is far below a tenth.
  const Eigen::MatrixXd information = passes.passes()[0].run.calibration.covariance.inverse() +
                                      second.run.calibration.covariance.inverse() -
                                      second.run.known_before.covariance.inverse();
  EXPECT_NEAR((information * combined.covariance).trace() / 20, 1, 0.1);
  EXPECT_TRUE(combined.verdict.trustworthy);
  // The second pass alone would leave the parameters as it found them, within a factor of two.
  EXPECT_THAT(combined.verdict.findings, Not(has_finding(FindingCode::kNotDetermined)));
  ASSERT_TRUE(combined.determined);
  EXPECT_EQ(combined.determined->coefficients, 14);
}

TEST(SeveralPasses, OfTwoStartUpsAreNotToBeUsedTogether) {
  Scenario other = with_gyros_of(two_hours().truth, 6, hours(9));
  for (GyroScenario& gyro : other.gyros) {
    gyro.drift.kappa_rad_s.reset();
  }
  const SeveralPasses passes = after_two_hours_and(sim::simulate(other).pass);
  EXPECT_FALSE(passes.passes().at(1).coefficients.holds());
  EXPECT_TRUE(passes.passes()[1].alignments.holds());
  EXPECT_THAT(passes.combined().calibration.verdict.findings, has_finding(FindingCode::kCoefficientsMoved));
  EXPECT_THAT(passes.combined().calibration.verdict.findings, Not(has_finding(FindingCode::kAlignmentMoved)));
  EXPECT_FALSE(passes.combined().calibration.verdict.trustworthy);
}

TEST(SeveralPasses, TellAnAlignmentThatMovedBetweenThem) {
  Scenario turned = with_gyros_of(two_hours().truth, 6, hours(9));
  turned.gyros[1].misalignment_rad->x() += kArcminute;
  const SeveralPasses passes = after_two_hours_and(sim::simulate(turned).pass);
  EXPECT_TRUE(passes.passes().at(1).coefficients.holds());
  EXPECT_FALSE(passes.passes()[1].alignments.holds());
  EXPECT_THAT(passes.combined().calibration.verdict.findings, has_finding(FindingCode::kAlignmentMoved));
}

TEST(SeveralPasses, OfOneStartUpDisagreeNoMoreThanChance) {
  // The covariance of estimator invariant is too small for some passes as short as these.
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  Agreement sum;
  for (std::uint64_t pair = 0; pair < 8; ++pair) {
    const auto first = sim::simulate(scenario_in_eq1(100 + pair, hours(2)));
    auto second = sim::simulate(with_gyros_of(first.truth, 200 + pair, hours(9)));
    SeveralPasses passes(options);
    passes.add("first", first.pass);
    // What a pass is told before is no part of the comparison, however much it is.
    for (std::size_t k = 0; k < 2; ++k) {
      GyroPrior& prior = second.pass.settings.gyros[k];
      prior.drift_common_sigma_rad_s = 3e-7;
      for (const auto& [coefficient, value] : first.truth.gyros[k].drift_rad_s) {
        prior.drift_rad_s[coefficient] = value + 3e-7;
      }
    }
    const PassAlone& alone = passes.add("second", second.pass);
    for (const Agreement& agreement : {alone.coefficients, alone.alignments}) {
      sum.chi_square += agreement.chi_square;
      sum.degrees_of_freedom += agreement.degrees_of_freedom;
    }
  }
  RecordProperty("chi_square", std::to_string(sum.chi_square) + " of " + std::to_string(sum.degrees_of_freedom));
  const chi_squared chance(sum.degrees_of_freedom);
  EXPECT_GT(sum.chi_square, quantile(chance, 0.001));
  EXPECT_LT(sum.chi_square, quantile(chance, 0.999));
}

TEST(SeveralPasses, KeepTheFaultOfAPassThatIsNotToBeUsedAlone) {
  SeveralPasses passes(told());
  Pass noisy = two_hours().pass;
  noisy.settings.star_tracker_noise_rad /= 3;  // the fixes scatter far more than told
  passes.add("noisy", noisy);
  passes.add("second", of_the_same_start_up().pass);
  EXPECT_THAT(passes.combined().calibration.verdict.findings, has_finding(FindingCode::kPassNotTrustworthy));
  EXPECT_FALSE(passes.combined().calibration.verdict.trustworthy);
}

TEST(SeveralPasses, KnowTheAlignmentInSteadyFlightByThePassWithSlews) {
  Scenario steady = with_gyros_of(two_hours().truth, 6, hours(9));
  steady.attitude.slews = std::vector<Slew>{};
  const SeveralPasses passes = after_two_hours_and(sim::simulate(steady).pass);
  EXPECT_THAT(passes.passes().at(1).run.calibration.verdict.findings, has_finding(FindingCode::kWeakAlignmentAxis));
  const Verdict& verdict = passes.combined().calibration.verdict;
  EXPECT_THAT(verdict.findings, Not(has_finding(FindingCode::kWeakAlignmentAxis)));
  EXPECT_THAT(verdict.findings, Not(has_finding(FindingCode::kPassNotTrustworthy)));
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(SeveralPasses, KeepWhatNoneOfThemShows) {
  const auto steady = [](Scenario scenario) {
    scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
    scenario.attitude.slews = std::vector<Slew>{};
    return sim::simulate(scenario);
  };
  const sim::SimulatedPass first = steady(scenario_in_eq1(7, hours(2)));
  SeveralPasses passes{CalibrationOptions()};
  passes.add("first", first.pass);
  passes.add("second", steady(with_gyros_of(first.truth, 8, hours(9))).pass);
  const Verdict& steadily = passes.combined().calibration.verdict;
  const auto its = std::ranges::find(steadily.findings, FindingCode::kStarTrackerErrorsNotShown, &Finding::code);
  ASSERT_NE(its, steadily.findings.end());
  EXPECT_THAT(its->evidence, HasSubstr("in each pass, as in second: 1σ"));
  passes.add("slews", sim::simulate(with_gyros_of(first.truth, 9, hours(18))).pass);
  EXPECT_THAT(passes.combined().calibration.verdict.findings,
              Not(has_finding(FindingCode::kStarTrackerErrorsNotShown)));
}

TEST(SeveralPasses, GoIntoACatalogueEachAloneAndTogether) {
  SeveralPasses passes(told());
  passes.add("first", two_hours().pass);
  ASSERT_EQ(passes.catalogue_entries().size(), 1U);
  EXPECT_EQ(passes.catalogue_entries()[0].passes, 1);
  EXPECT_EQ(passes.catalogue_entries()[0].start_up, "");
  Pass second = of_the_same_start_up().pass;
  second.settings.start_up = "May";
  passes.add("second", second);
  const std::vector<CatalogueEntry> entries = passes.catalogue_entries();
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[1].pass, "second");
  EXPECT_EQ(entries[1].passes, 1);
  EXPECT_EQ(entries[1].calibration.covariance, passes.passes()[1].run.calibration.covariance);
  EXPECT_EQ(entries[2].pass, "second");
  EXPECT_EQ(entries[2].passes, 2);
  EXPECT_EQ(entries[2].calibration.covariance, passes.combined().calibration.covariance);
  EXPECT_EQ(entries[2].calibration.start_up, "May");
  for (const CatalogueEntry& entry : entries) {
    EXPECT_EQ(entry.spacecraft, "Resurs-DK1");
    EXPECT_EQ(entry.start_up, "May");
  }
}

TEST(SeveralPasses, RefuseAPassThatDoesNotBelong) {
  const Pass& good = of_the_same_start_up().pass;
  Pass second = good;
  second.settings.epoch = two_hours().pass.settings.epoch + hours(1);
  EXPECT_THAT(refusal_of(second), HasSubstr("begins before the one before it ends"));
  second = good;
  second.settings.spacecraft = "another";
  EXPECT_THAT(refusal_of(second), HasSubstr("the pass is of another, the one before of Resurs-DK1"));
  second = good;
  second.settings.gyros.push_back(second.settings.gyros.back());
  EXPECT_THAT(refusal_of(second), HasSubstr("the pass has 3 gyros, the one before 2"));
  second = good;
  second.settings.further_star_trackers.emplace_back();
  EXPECT_THAT(refusal_of(second), HasSubstr("other star trackers"));
  second = good;
  second.settings.start_up = "June";
  EXPECT_THAT(refusal_of(second), HasSubstr("start-up 'June', the ones before of 'May'"));
}

}  // namespace
}  // namespace trihedron::ground
