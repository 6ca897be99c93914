#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "consistency/bound.hpp"
#include "consistency/statistics.hpp"
#include "consistency/tables.hpp"
#include "trihedron/campaign/perform.hpp"
#include "trihedron/campaign/sampling.hpp"
#include "trihedron/campaign/statistics.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/io/campaign.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::consistency {
namespace {

io::CampaignFile campaign_file(const std::string& name) {
  return io::CampaignFile(std::string(TRIHEDRON_VALIDATION) + "/consistency/" + name, sim::expect_possible);
}

/// The first run in this cell by this estimator.
std::uint64_t run_in(const CampaignPlan& plan, const std::vector<std::string>& cell, const std::string& estimator) {
  const auto setting = std::ranges::find(plan.inputs, "calibration.estimator", &CampaignInput::key);
  for (std::uint64_t run = 0; run < plan.runs; run += plan.repeats) {
    const std::vector<double> draws = campaign::draws_of_run(plan, run);
    const auto by = static_cast<std::size_t>(draws[static_cast<std::size_t>(setting - plan.inputs.begin())]);
    if (values_of(plan, draws) == cell && setting->options[by] == estimator) {
      return run;
    }
  }
  throw std::runtime_error("no such cell");
}

/// A flight in this cell, of another seed than the campaign gives it, and its calibration.
RunRecord flown(const io::CampaignFile& file, const std::vector<std::string>& cell, const std::string& estimator,
                std::uint64_t seed) {
  const std::uint64_t run = run_in(file.plan(), cell, estimator);
  const auto setup_of = [&](std::uint64_t /*of_campaign*/, std::span<const double> draws) {
    return campaign::RunSetup{file.scenario(seed, draws), file.options(draws)};
  };
  return campaign::perform(file.plan(), run, setup_of);
}

const std::vector<std::string> kFirstCell = {"slews", "plane-normal", "1e-07rad/s", "1arcmin", "0rad/s^0.5"};

Scenario first_scenario() {
  const io::CampaignFile file = campaign_file("filters.toml");
  const std::vector<double> draws = campaign::draws_of_run(file.plan(), run_in(file.plan(), kFirstCell, "invariant"));
  return file.scenario(1'000'001, draws);
}

TEST(Campaigns, HaveEachOfTheirCellsAsOftenByEachEstimator) {
  for (const auto& [name, cells, runs] :
       {std::tuple("filters.toml", 216U, 100U), {"whole-pass.toml", 12U, 100U}, {"steady.toml", 18U, 20U}}) {
    const io::CampaignFile file = campaign_file(name);
    std::map<std::vector<std::string>, unsigned> found;
    for (std::uint64_t run = 0; run < file.plan().runs; ++run) {
      ++found[values_of(file.plan(), campaign::draws_of_run(file.plan(), run))];
    }
    EXPECT_EQ(found.size(), cells) << name;
    for (const auto& [cell, count] : found) {
      EXPECT_EQ(count, 2 * runs) << name;
    }
  }
}

/// So that the NEES of an honest estimator is χ².
TEST(Campaigns, TellTheEstimatorTheTruth) {
  const io::CampaignFile file = campaign_file("filters.toml");
  std::set<double> walks;
  for (std::uint64_t run = 0; run < file.plan().runs; run += file.plan().repeats) {
    const std::vector<double> draws = campaign::draws_of_run(file.plan(), run);
    const Scenario scenario = file.scenario(1, draws);
    const CalibrationOptions options = file.options(draws);
    EXPECT_FALSE(options.find_noise);
    for (const GyroScenario& gyro : scenario.gyros) {
      EXPECT_EQ(options.direction_random_walk_rad_sqrt_s, gyro.drift.direction_walk_rad_sqrt_s);
      EXPECT_NEAR(gyro.alignment_prior_sigma_rad * std::sqrt(3.0) / gyro.misalignment_magnitude_rad, 1, 1e-15);
      EXPECT_EQ(gyro.drift.outside_sigma_rad_s, 0);
      walks.insert(gyro.drift.direction_walk_rad_sqrt_s);
    }
  }
  EXPECT_EQ(walks, (std::set<double>{0, 1e-8, 1e-7}));
}

/// At rest and without drift the momenta stand still in the case: each reading is φ0 − δ + B Δκ t, a straight line in
/// time. Its beginning is free, so that nothing is learned of the alignment and the drift has its slope's information.
TEST(Bound, AtRestIsThatOfAStraightLine) {
  Scenario scenario = first_scenario();
  scenario.duration = std::chrono::minutes(20);
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  scenario.attitude.jitter_rad = 0;
  scenario.attitude.slews = std::vector<Slew>{};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.kappa_rad_s.emplace().fill(0);
  }
  const sim::SimulatedPass flown = sim::simulate(scenario);
  const PassSettings& settings = flown.pass.settings;
  const ParameterCovariance bound = parameter_bound(settings, flown.truth);

  // Eleven samples to both sides of a fix, each with 2″; at both ends of the pass one alone.
  const double readout_variance = std::pow(2 * kArcsecond, 2);
  const double of_cubic = 3.0 * (3 * 121 + 33 - 1) / (21 * 23 * 25);
  const auto fixes = static_cast<int>(flown.truth.t.size());
  Eigen::Matrix<double, 6, 14> by_drift = Eigen::Matrix<double, 6, 14>::Zero();
  Eigen::Matrix<double, 4, 6> across = Eigen::Matrix<double, 4, 6>::Zero();
  Eigen::Matrix<double, 6, 3> by_fix;
  for (int k = 0; k < 2; ++k) {
    const Truth::Gyro& gyro = flown.truth.gyros[static_cast<std::size_t>(k)];
    const Eigen::Matrix3d C_in_c = flown.truth.q_in_c.front().toRotationMatrix();
    const Eigen::Matrix3d C_in_b = C_in_c * Rot<C, C>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
    const Eigen::Vector3d h_in = Eigen::Map<const Eigen::Vector3d>(&flown.truth.h_in[static_cast<std::size_t>(3 * k)]);
    by_drift.block<3, 7>(3 * k, 7 * k) = C_in_b * Esg7::basis<double>(C_in_b.transpose() * h_in);
    const Eigen::Vector3d first = h_in.unitOrthogonal();
    across.block<1, 3>(2 * k, 3 * k) = first.transpose();
    across.block<1, 3>(2 * k + 1, 3 * k) = h_in.cross(first).transpose();
    by_fix.middleRows<3>(3 * k) = C_in_c;
  }
  const Eigen::Matrix<double, 4, 3> fix_noise = across * by_fix * settings.star_tracker_noise_rad.asDiagonal();
  const auto information_of = [&](double variance) {
    return Eigen::Matrix4d(fix_noise * fix_noise.transpose() + variance * Eigen::Matrix4d::Identity()).inverse().eval();
  };
  const double middle_s = to_seconds(scenario.duration) / 2;
  Eigen::Matrix4d of_slope = Eigen::Matrix4d::Zero();
  for (int i = 0; i < fixes; ++i) {
    const bool at_an_end = i == 0 || i == fixes - 1;
    of_slope += std::pow(3.0 * i - middle_s, 2) * information_of(readout_variance * (at_an_end ? 1 : of_cubic));
  }
  const Eigen::Matrix<double, 4, 14> seen = across * by_drift;
  const double prior_information = std::pow(scenario.gyros[0].drift.prior_sigma_rad_s, -2);
  const Eigen::Matrix<double, 14, 14> information =
      prior_information * Eigen::Matrix<double, 14, 14>::Identity() + seen.transpose() * of_slope * seen;
  const Eigen::Matrix<double, 14, 14> expected = information.inverse();

  const double alignment_variance = std::pow(scenario.gyros[0].alignment_prior_sigma_rad, 2);
  for (int k = 0; k < 2; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(bound(Parameters::alignment(k) + axis, Parameters::alignment(k) + axis), alignment_variance,
                  1e-9 * alignment_variance);
    }
    for (int i = 0; i < 7; ++i) {
      const double variance = expected(7 * k + i, 7 * k + i);
      EXPECT_NEAR(bound(Parameters::drift(k) + i, Parameters::drift(k) + i), variance, 1e-6 * variance);
    }
  }
}

/// Where the first, wrong values are off by little, the filter's linearisation is that of the truth.
TEST(Bound, IsTheCovarianceOfTheFilterForSmallMisalignments) {
  Scenario scenario = first_scenario();  // slews, 1e-7 rad/s, 1′
  scenario.duration = std::chrono::hours(2);
  const sim::SimulatedPass flown = sim::simulate(scenario);
  CalibrationOptions options;
  options.estimator = Estimator::kInvariant;
  options.drift_model = kEsg7;
  options.direction_random_walk_rad_sqrt_s = 0;
  const Eigen::MatrixXd covariance = ground::calibrate(flown.pass, options).calibration.covariance;
  const ParameterCovariance bound = parameter_bound(flown.pass.settings, flown.truth);
  for (Eigen::Index i = 0; i < bound.rows(); ++i) {
    EXPECT_NEAR(std::sqrt(covariance(i, i) / bound(i, i)), 1, 0.03) << i;
  }
}

/// An estimator whose covariance is known: combinations of the parameters, oblique in all of them, with these variances
/// in units of their prior ones.
struct KnownEstimator {
  explicit KnownEstimator(const ParameterErrors& variances) {
    prior_sigma.setConstant(1e-6);
    for (int k = 0; k < 2; ++k) {
      prior_sigma.segment<3>(Parameters::alignment(k)).setConstant(5e-3);
    }
    prior = prior_sigma.cwiseAbs2().asDiagonal();
    Eigen::HouseholderQR<ParameterCovariance> oblique(ParameterCovariance::NullaryExpr([&] { return normal(random); }));
    root = prior_sigma.asDiagonal() * ParameterCovariance(oblique.householderQ()) *
           ParameterCovariance(variances.cwiseSqrt().asDiagonal());
    covariance = root * root.transpose();
  }

  /// Of each combination, in its 1-sigma.
  ParameterErrors draw() {
    return ParameterErrors::NullaryExpr([&] { return normal(random); });
  }

  std::mt19937_64 random{2};
  std::normal_distribution<double> normal;
  ParameterErrors prior_sigma;
  ParameterCovariance prior;
  ParameterCovariance root;  ///< a column per combination
  ParameterCovariance covariance;
};

/// Variance of a combination over its prior one, whose prior sigma is `ratio` of that by the measurements alone.
double share(double ratio) { return 1 / (1 + ratio * ratio); }

TEST(ObservableNees, OfDrawnErrorsIsTheSquareOfWhatWasDrawn) {
  ParameterErrors variances = ParameterErrors::Constant(1e-9);
  variances.head<3>() << 1, share(9.9), share(10.1);
  KnownEstimator estimator(variances);
  constexpr int kRuns = 1000;
  double mean = 0;
  for (int run = 0; run < kRuns; ++run) {
    const ParameterErrors drawn = estimator.draw();
    const Nees nees = observable_nees(estimator.root * drawn, estimator.covariance, estimator.prior);
    ASSERT_EQ(nees.freedom, 18);
    ASSERT_NEAR(nees.value, drawn.tail<18>().squaredNorm(), 1e-4 * nees.value);  // 1e-16 of the prior in 1e-9 of it
    mean += nees.value / kRuns;
  }
  const campaign::ChiSquareBounds band = campaign::chi_square_bounds(18 * kRuns, 0.95);
  EXPECT_GE(mean / 18, band.low);
  EXPECT_LE(mean / 18, band.high);
}

TEST(ObservableNees, DoesNotCountWhatStaysAtItsPrior) {
  ParameterErrors variances = ParameterErrors::Constant(1e-6);
  variances(5) = 1;
  KnownEstimator estimator(variances);
  const ParameterErrors errors = estimator.root * estimator.draw();
  const Nees nees = observable_nees(errors, estimator.covariance, estimator.prior);
  const Nees far_off = observable_nees(errors + 100 * estimator.root.col(5), estimator.covariance, estimator.prior);
  EXPECT_EQ(nees.freedom, 19);
  EXPECT_NEAR(far_off.value, nees.value, 1e-6 * nees.value);
}

TEST(ObservableNees, IsNothingBeforeTheFlight) {
  KnownEstimator estimator(ParameterErrors::Ones());
  const Nees nees = observable_nees(estimator.root * estimator.draw(), estimator.covariance, estimator.prior);
  EXPECT_EQ(nees.freedom, 0);
  EXPECT_EQ(nees.value, 0);
}

TEST(Difference, OfEqualEstimatesIsZero) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  for (const auto& difference_of : {difference_by_parameter, difference_by_combination}) {
    const Difference none = difference_of(ParameterErrors::Zero(), estimator.covariance, estimator.covariance);
    EXPECT_EQ(none.square, 0);
    EXPECT_NEAR(none.variance_ratio, 1, 1e-6);
    EXPECT_TRUE(agrees(none));
  }
}

TEST(Difference, ByParameterIsInItsSigmas) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  ParameterErrors sigma = estimator.covariance.diagonal().cwiseSqrt();
  sigma.head<10>() *= -2;
  const Difference difference = difference_by_parameter(sigma, 9 * estimator.covariance, estimator.covariance);
  EXPECT_NEAR(difference.square, (4 + 1) / 2.0, 1e-9);
  EXPECT_NEAR(difference.variance_ratio, 9, 1e-9);
}

/// One that no parameter shows by itself counts as much as any other.
TEST(Difference, ByCombinationSeesEachCombination) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  const ParameterErrors best_known = estimator.root.col(0);
  const ParameterCovariance less_known =
      estimator.covariance + 40 * best_known * best_known.transpose();  // 41 times the variance
  const Difference hidden = difference_by_parameter(3 * best_known, less_known, estimator.covariance);
  const Difference seen = difference_by_combination(3 * best_known, less_known, estimator.covariance);
  EXPECT_LT(hidden.square, 1e-5);
  EXPECT_LT(hidden.variance_ratio, 1 + 1e-4);
  EXPECT_NEAR(seen.square, 9.0 / 20, 1e-6);
  EXPECT_NEAR(seen.variance_ratio, (19 + 41) / 20.0, 1e-6);
}

TEST(Difference, MayBeAThirdOfASigmaBesideWhatTheFirstSaysToKnowLess) {
  EXPECT_TRUE(agrees({0.11, 1}));
  EXPECT_FALSE(agrees({0.12, 1}));
  EXPECT_TRUE(agrees({0.11 + 2, 3}));
  EXPECT_FALSE(agrees({0.12 + 2, 3}));
  EXPECT_FALSE(agrees({0.12, 0.9}));
  EXPECT_FALSE(agrees({std::nan(""), 1}));
}

/// Two flights in each of two cells, by two estimators, with errors of a sigma in each of 20 parameters.
struct Flown {
  Flown() {
    plan.repeats = 2;
    plan.runs = 8;
    plan.keeps_covariance = true;
    add("attitude", {"slews", "none"}, false);
    add("calibration.estimator", {"invariant", "batch"}, false);
    add("gyro.drift.direction_walk", {"0"}, true);
    add("gyro.drift.prior_sigma", {"1"}, true);
    add("gyro.misalignment_magnitude", {"30"}, true);
    add("gyro.unit", {"oblique"}, false);
    for (std::uint64_t run = 0; run < plan.runs; ++run) {
      RunRecord record;
      record.run = run;
      record.seed = campaign::seed_of_run(plan, run);
      record.draws = campaign::draws_of_run(plan, run);
      record.outcome = RunOutcome::kTrustworthy;
      record[RunQuantity::kNees] = {20};
      record[RunQuantity::kNisMeanOfAll] = {4};
      record[RunQuantity::kNisFixesOfAll] = {10800};
      record[RunQuantity::kDriftError].assign(14, 1e-9);
      record[RunQuantity::kAlignmentError].assign(6, 1e-5);
      set_covariance(record, covariance());
      records.push_back(std::move(record));
    }
  }

  void add(const std::string& key, const std::vector<std::string>& options, bool numbers) {
    CampaignInput& input = plan.inputs.emplace_back();
    input.key = key;
    input.distribution = {.kind = Distribution::Kind::kGrid, .options = options.size()};
    input.options = options;
    if (numbers) {
      input.numbers = {std::stod(options.front())};
    }
  }

  static ParameterCovariance covariance() {
    ParameterErrors sigma = ParameterErrors::Constant(1e-9);
    for (int k = 0; k < 2; ++k) {
      sigma.segment<3>(Parameters::alignment(k)).setConstant(1e-5);
    }
    return sigma.cwiseAbs2().asDiagonal();
  }

  static void set_covariance(RunRecord& record, const ParameterCovariance& covariance) {
    record[RunQuantity::kCovariance].assign(covariance.data(), covariance.data() + covariance.size());
  }

  [[nodiscard]] Campaign campaign() const { return campaign_of(plan, records, 100); }

  CampaignPlan plan;
  std::vector<RunRecord> records;
};

TEST(Tables, MarkWhatLiesOutsideItsBand) {
  Flown flown;
  // Runs 0 … 3 are of the first estimator, in cells slews and none, 4 … 7 of the second.
  flown.records[2][RunQuantity::kNees] = {45};
  flown.records[3][RunQuantity::kNees] = {46};
  flown.records[4][RunQuantity::kNees] = {std::nan("")};
  flown.records[6][RunQuantity::kNisMeanOfAll] = {3.9};
  const std::string table = estimators_table(flown.campaign(), [](const RunRecord& run) {
    const double ratio = run.draws[1] == 0 ? 1 : 2;  // of the second estimator the variances are a quarter
    return ParameterErrors(Flown::covariance().diagonal() / (ratio * ratio));
  });
  EXPECT_NE(table.find("95 % of the means of a consistent estimator's NEES lie in 12.2 … 29.7"), std::string::npos)
      << table;  // χ² of 40: 24.433 and 59.342
  EXPECT_NE(table.find("| slews | oblique | 1 | 30 | 0 | 20.0 | 4.000 | 1.00 | nan ↑ | 4.000 | 2.00 |"),
            std::string::npos)
      << table;
  EXPECT_NE(table.find("| none | oblique | 1 | 30 | 0 | 45.5 ↑ | 4.000 | 1.00 | 20.0 | 3.950 ↓ | 2.00 |"),
            std::string::npos)
      << table;
  EXPECT_NE(table.find("NEES, batch: outside its band in 1 of 2 rows up to 1°, in 0 of 0 beyond."), std::string::npos);
}

TEST(Tables, LeaveOutWhatTheFlightsDoNotMakeObservable) {
  const Flown flown;
  const std::string table = observable_table(flown.campaign(), [](const RunRecord& /*run*/) {
    ParameterErrors variance = 1e6 * Flown::covariance().diagonal();
    variance.head<2>() /= 1e6;  // of the prior nothing is left to know
    return ParameterCovariance(variance.asDiagonal());
  });
  EXPECT_NE(table.find("| 18.0 | 18.00 | 10.7 … 27.2 |"), std::string::npos) << table;  // χ² of 36: 21.336 and 54.437
}

TEST(Tables, TellWhichEstimatesDoNotAgree) {
  Flown flown;
  for (std::size_t run = 0; run < 4; ++run) {
    Flown::set_covariance(flown.records[run], (run < 2 ? 1.21 : 1) * Flown::covariance());
    for (double& error : flown.records[run][RunQuantity::kAlignmentError]) {
      error *= run < 2 ? 1.5 : 2;
    }
  }
  const std::string table = agreement_table(flown.campaign());
  EXPECT_NE(table.find("| slews | oblique | 1 | 30 | 0 | 0.27 | 1.100 | 0.27 | 1.100 |"), std::string::npos) << table;
  EXPECT_NE(table.find("| none | oblique | 1 | 30 | 0 | 0.55 ↑ | 1.000 | 0.55 ↑ | 1.000 |"), std::string::npos)
      << table;
  EXPECT_NE(table.find("by parameter 1, by combination 1 of 2 rows"), std::string::npos) << table;
}

TEST(Tables, AreOfWholeCampaignsOverTheGridAlone) {
  Flown flown;
  EXPECT_EQ(campaign_of(flown.plan, flown.records, 1).cells.front().by_estimator.front().size(), 1U);
  flown.records.pop_back();
  EXPECT_THROW((void)flown.campaign(), std::runtime_error);
  Flown other;
  other.plan.inputs.back().key = "gyro.unit.1";
  EXPECT_THROW((void)other.campaign(), std::runtime_error);
}

/// Misalignments of degrees, and drift ten times that of a good gyro: first estimates far enough off that the filter
/// has to begin anew, once or more.
TEST(Flights, WithWrongFirstEstimatesAreNotLost) {
  const io::CampaignFile file = campaign_file("filters.toml");
  using Values = std::vector<std::string>;
  const std::vector<std::pair<Values, std::uint64_t>> flights = {
      {{"slews", "plane-normal", "1e-05rad/s", "60arcmin", "0rad/s^0.5"}, 31'000'010},
      {{"slews", "plane-normal", "1e-05rad/s", "300arcmin", "0rad/s^0.5"}, 34'000'012},
      {{"slews", "plane-plane", "1e-07rad/s", "300arcmin", "1e-07rad/s^0.5"}, 48'000'011},
      {{"none", "plane-plane", "1e-07rad/s", "300arcmin", "0rad/s^0.5"}, 154'000'001},
      {{"none", "plane-plane", "1e-05rad/s", "300arcmin", "0rad/s^0.5"}, 178'000'014},
      {{"slews", "plane-normal", "1e-05rad/s", "300arcmin", "1e-07rad/s^0.5"}, 36'000'011},
      {{"slews", "plane-plane", "1e-05rad/s", "300arcmin", "1e-08rad/s^0.5"}, 71'000'009},
      {{"slews", "plane-plane", "1e-06rad/s", "300arcmin", "0rad/s^0.5"}, 58'000'045},
      {{"slews", "plane-plane", "1e-06rad/s", "300arcmin", "0rad/s^0.5"}, 58'000'052},
      {{"slews", "plane-plane", "1e-06rad/s", "300arcmin", "1e-08rad/s^0.5"}, 59'000'046}};
  for (const auto& [cell, seed] : flights) {
    const RunRecord run = flown(file, cell, "invariant", seed);
    EXPECT_EQ(run.at(RunQuantity::kNisFixesOfAll), 10800) << seed;
    EXPECT_LT(run.at(RunQuantity::kNees), 50) << seed;  // χ² of 20, once in 5000
  }
}

TEST(Flights, OfFilterAndBatchAgree) {
  const io::CampaignFile file = campaign_file("whole-pass.toml");
  const std::vector<std::string> cell = {"none", "plane-plane", "1e-06rad/s", "30arcmin", "0rad/s^0.5"};
  constexpr std::uint64_t kSeed = 160'000'001;
  const RunRecord filter = flown(file, cell, "invariant", kSeed);
  const RunRecord batch = flown(file, cell, "batch", kSeed);
  const ParameterErrors difference = errors_of(batch) - errors_of(filter);
  EXPECT_TRUE(agrees(difference_by_parameter(difference, covariance_of(filter), covariance_of(batch))));
  EXPECT_TRUE(agrees(difference_by_combination(difference, covariance_of(filter), covariance_of(batch))));
  const ParameterCovariance prior = prior_covariance(file.scenario(kSeed, filter.draws));
  for (const RunRecord& run : {filter, batch}) {
    // About the orbit normal the alignment of neither gyro.
    EXPECT_EQ(observable_nees(errors_of(run), covariance_of(run), prior).freedom, 18);
    EXPECT_NEAR(nees(errors_of(run), covariance_of(run)), run.at(RunQuantity::kNees),
                1e-6 * run.at(RunQuantity::kNees));
    const double fixes = run.at(RunQuantity::kNisFixesOfAll);
    const campaign::ChiSquareBounds band = campaign::chi_square_bounds(4 * fixes, 0.95);
    EXPECT_GE(run.at(RunQuantity::kNisMeanOfAll) / 4, band.low);
    EXPECT_LE(run.at(RunQuantity::kNisMeanOfAll) / 4, band.high);
    EXPECT_GE(fixes, 10700);
  }
}

}  // namespace
}  // namespace trihedron::consistency
