// Every combination of gyros, drift model, further states and star trackers works on board: flights of minutes over a
// set of layouts in which each two choices meet, with all at work that the estimator has a state for.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "mission.hpp"

namespace trihedron {
namespace {

constexpr std::size_t kFactors = 10;
/// How many choices there are of gyros, drift model, star trackers, and each of the further states.
constexpr std::array<int, kFactors> kChoices = {3, 6, 3, 2, 2, 2, 2, 2, 2, 2};
using Choice = std::array<int, kFactors>;

Layout layout_of(const Choice& choice) {
  const DriftModelId models[] = {kEsg7, kEsg20, vsh(1), vsh(2), vsh(3), vsh(6)};
  Layout layout;
  layout.gyros = 2 + choice[0];
  layout.drift_model = models[choice[1]];
  layout.star_trackers = 1 + choice[2];
  layout.further = {.wandering_drift = choice[3] != 0,
                    .readout_bias = choice[4] != 0,
                    .coefficient_change = choice[5] != 0,
                    .clock_offset = choice[6] != 0,
                    .orbital_error = choice[7] != 0,
                    .orbital_drift = choice[8] != 0,
                    .polhode = choice[9] != 0};
  return layout;
}

/// Layouts in which each choice meets each choice of every other factor: step by step the one, of many at random, that
/// brings the most new meetings.
std::vector<Layout> pairwise_layouts() {
  using Meeting = std::tuple<std::size_t, int, std::size_t, int>;
  const auto meetings = [](const Choice& choice) {
    std::vector<Meeting> of;
    for (std::size_t i = 0; i < kFactors; ++i) {
      for (std::size_t j = i + 1; j < kFactors; ++j) {
        of.emplace_back(i, choice[i], j, choice[j]);
      }
    }
    return of;
  };
  std::size_t all = 0;
  for (std::size_t i = 0; i < kFactors; ++i) {
    for (std::size_t j = i + 1; j < kFactors; ++j) {
      all += static_cast<std::size_t>(kChoices[i] * kChoices[j]);
    }
  }
  std::mt19937 random(3);
  std::set<Meeting> met;
  std::vector<Layout> layouts;
  while (met.size() < all) {
    Choice best{};
    std::size_t most = 0;
    for (int candidate = 0; candidate < 300; ++candidate) {
      Choice choice;
      for (std::size_t i = 0; i < kFactors; ++i) {
        choice[i] = static_cast<int>(random() % static_cast<unsigned>(kChoices[i]));
      }
      std::size_t fresh = 0;
      for (const Meeting& meeting : meetings(choice)) {
        fresh += met.count(meeting) == 0 ? 1U : 0U;
      }
      if (fresh > most) {
        most = fresh;
        best = choice;
      }
    }
    for (const Meeting& meeting : meetings(best)) {
      met.insert(meeting);
    }
    layouts.push_back(layout_of(best));
  }
  return layouts;
}

/// Sums over flights.
struct Sum {
  double nees = 0;
  double freedom = 0;
};

/// χ² of so many degrees of freedom as a normal deviate (Wilson and Hilferty 1931).
double deviate(double square, double freedom) {
  const double variance = 2 / (9 * freedom);
  return (std::cbrt(square / freedom) - (1 - variance)) / std::sqrt(variance);
}

/// Of the 1-sigmas after a flight (of all states but the directions) over those before it: the largest of all kinds of
/// further states and their owners, of which each stands for its best component.
double least_gain(const CalibrationSetup& setup, const Layout& layout, const Eigen::VectorXd& sigma) {
  double largest = 0;
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    const Layout::Owners owners = layout.owners(kind.state);
    for (int owner = owners.begin; layout.has(kind.state) && owner < owners.end; ++owner) {
      const int its = layout.first(kind.state, owner);
      const double before = kind.state == FurtherState::kWanderingDrift ? setup.wandering_drift.sigma
                                                                        : prior_sigma_of_further_state(setup, its);
      const double after = sigma.segment(its - layout.direction(layout.gyros), kind.size).minCoeff();
      largest = std::max(largest, after / before);
    }
  }
  return largest;
}

void expect_that_it_works(const Layout& layout, unsigned seed, Sum& sum) {
  SCOPED_TRACE(testing::Message() << layout.gyros << " gyros, " << layout.drift_size() << " coefficients, "
                                  << layout.star_trackers << " star trackers, wandering drift "
                                  << layout.further.wandering_drift << ", readout bias " << layout.further.readout_bias
                                  << ", change " << layout.further.coefficient_change << ", clock offset "
                                  << layout.further.clock_offset << ", orbital error " << layout.further.orbital_error
                                  << ", orbital drift " << layout.further.orbital_drift << ", polhode "
                                  << layout.further.polhode);
  const test::Mission mission({.layout = layout, .duration_s = 300, .seed = seed});
  const auto on_board = mission.given.on_board();
  std::size_t used = 0;
  Time last{};
  const test::OnReport note = [&](const StepReport& report) {
    used += report.fix.used() ? 1U : 0U;
    last = report.fix.used() ? report.fix.t : last;
  };
  mission.fly(*on_board, note);
  test::flush(*on_board, note);
  EXPECT_EQ(used, mission.fixes.size());
  EXPECT_TRUE(on_board->navigation_attitude().ok());

  // What is off is not there.
  const test::FullEstimator& estimator = on_board->estimator();
  ASSERT_EQ(estimator.states(), layout.size());
  EXPECT_EQ(estimator.shared().size(), layout.shared_size());
  for (int k = 0; k < layout.gyros; ++k) {
    EXPECT_EQ(estimator.gyros()[k].drift_rad_s.size(), layout.drift_columns());
    EXPECT_TRUE(layout.further.readout_bias || estimator.gyros()[k].readout_bias.norm() == 0);
  }

  // What is there is estimated: each state but the directions within its sigmas, and all of them together.
  const int first = layout.direction(layout.gyros);
  const auto last_sample = static_cast<std::size_t>(8 * to_seconds(last.time_since_epoch()));
  const Eigen::VectorXd errors = mission.errors(estimator, last_sample).tail(layout.size() - first);
  const Eigen::MatrixXd root = test::state_root(estimator).bottomRows(layout.size() - first);
  const Eigen::VectorXd sigma = root.rowwise().norm();
  // Once in 7000 of 3000 states; the flights are always the same.
  EXPECT_LT((errors.array() / sigma.array()).abs().maxCoeff(), 4.5);
  const double nees = test::normalised_square(errors, root * root.transpose());
  // While alignments are known to minutes of arc, what is of second order makes single flights scatter 1.4 times as
  // much as by chance; in the sum below it has no bias.
  EXPECT_LT(std::abs(deviate(nees, static_cast<double>(errors.size()))), 5);
  sum.nees += nees;
  sum.freedom += static_cast<double>(errors.size());

  // Beside so many others some can hardly be told apart in minutes, but nothing is lost.
  EXPECT_LT(least_gain(mission.given.setup, layout, sigma), 1);
}

/// Those with a drift model of degree 6, or those without.
void expect_that_all_work(bool largest) {
  Sum sum;
  unsigned seed = 0;
  const std::vector<Layout> layouts = pairwise_layouts();
  EXPECT_LT(layouts.size(), 30U);
  for (const Layout& layout : layouts) {
    ++seed;
    if ((layout.drift_model == vsh(6)) == largest) {
      expect_that_it_works(layout, seed, sum);
    }
  }
  EXPECT_LT(std::abs(deviate(sum.nees, sum.freedom)), 4);
}

TEST(EveryLayout, WorksOnBoard) { expect_that_all_work(false); }

TEST(EveryLayout, OfDegreeSixIsConsistentOnBoard) { expect_that_all_work(true); }

TEST(EveryFurtherState, IsFoundInMinutesOnceTheGyrosAreCalibrated) {
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    Layout layout{.gyros = 3};
    if (kind.flag != nullptr) {
      layout.further.*kind.flag = true;
    } else {
      layout.star_trackers = 2;
    }
    const test::Mission mission({.layout = layout, .duration_s = 300, .calibration_sigma = 1e-3});
    const auto on_board = mission.given.on_board();
    mission.fly(*on_board);
    const int first = layout.direction(layout.gyros);
    const Eigen::MatrixXd root = test::state_root(on_board->estimator()).bottomRows(layout.size() - first);
    // What wanders is new every five minutes.
    const double most = kind.state == FurtherState::kWanderingDrift ? 0.7 : 0.5;
    EXPECT_LT(least_gain(mission.given.setup, layout, root.rowwise().norm()), most) << static_cast<int>(kind.state);
  }
}

TEST(EveryLayout, HasTheSameResultsInAnyRoomForIt) {
  // Outliers up to reopening, a time without fixes, and a bad sample: every way through a step, bit for bit.
  test::Flight flight({.duration_s = 900, .fix_offset_s = 0.05});
  for (std::size_t i = 150; i < 180; ++i) {
    flight.fixes[i].q_in_c = flight.fixes[i].q_in_c * Eigen::Quaterniond(test::turn(1e-3, 0, 0));
  }
  std::erase_if(flight.fixes, [](const StarFix& fix) {
    return fix.t > Time(std::chrono::seconds(600)) && fix.t < Time(std::chrono::seconds(750));
  });
  flight.samples[77].h_b[0].setZero();
  const auto in_small = test::PairGiven().on_board({.interval = std::chrono::minutes(5)});
  const auto in_large = test::FullGiven().on_board({.interval = std::chrono::minutes(5)});
  std::vector<double> small;
  std::vector<double> large;
  const auto note = [](std::vector<double>& into, const StepReport& report) {
    into.insert(into.end(), {static_cast<double>(report.fix.status), report.fix.nis, report.angles.nis,
                             report.angle_residual, static_cast<double>(report.sample)});
    into.insert(into.end(), report.fix.innovation.begin(), report.fix.innovation.end());
    for (const auto& solution : {report.calibrated, report.navigated}) {
      if (solution) {
        into.insert(into.end(), solution->C_in_c.raw().reshaped().begin(), solution->C_in_c.raw().reshaped().end());
        into.insert(into.end(), solution->covariance_rad2.reshaped().begin(),
                    solution->covariance_rad2.reshaped().end());
      }
    }
  };
  test::fly(flight, *in_small, [&](const StepReport& report) { note(small, report); });
  test::fly(flight, *in_large, [&](const StepReport& report) { note(large, report); });
  EXPECT_GT(small.size(), 5 * flight.samples.size());
  EXPECT_EQ(small, large);
  EXPECT_EQ(test::state_root(in_small->estimator()), test::state_root(in_large->estimator()));
  for (int k = 0; k < 2; ++k) {
    const auto& a = in_small->estimator().gyros()[k];
    const auto& b = in_large->estimator().gyros()[k];
    EXPECT_EQ(a.h_in, b.h_in);
    EXPECT_EQ(Eigen::VectorXd(a.drift_rad_s), Eigen::VectorXd(b.drift_rad_s));
    EXPECT_EQ(a.C_c_b, b.C_c_b);
  }
}

}  // namespace
}  // namespace trihedron
