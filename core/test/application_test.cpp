#include "trihedron/core/application.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "application_flight.hpp"
#include "trihedron/core/snapshot.hpp"

namespace trihedron {
namespace {

using test::fly_from;
using test::kArcsecond;
using test::kNoFixes;
using enum Mode;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// When the calibration of these flights has been adopted: a window of twenty minutes, and the fixes after it.
constexpr double kAdopted_s = 1300;

const test::Flight& flight() {
  static const test::Flight its({.duration_s = 4800});
  return its;
}

std::vector<Mode> all_modes() {
  return {kStandby, kWaitingForFix, kAligning, kCalibrating, kNavigating, kDegraded, kFailed};
}

/// Readings that do not change, as of rotors that stand still.
std::vector<GyroSample> frozen(double from_s, double to_s) {
  std::vector<GyroSample> samples = flight().samples;
  const auto first = static_cast<std::size_t>(from_s * 8);
  for (auto i = first; i < static_cast<std::size_t>(to_s * 8); ++i) {
    for (int k = 0; k < 2; ++k) {
      samples[i].h_b[k] = samples[first].h_b[k];
    }
  }
  return samples;
}

/// A flight that leads into each mode.
PairApplication application_in(Mode mode) {
  PairApplication application;
  EXPECT_EQ(application.load(test::nominal_parameters()), Answer::kAccepted);
  fly_from(flight().samples, kNoFixes, 0, 1, application);
  if (mode != kStandby) {
    EXPECT_EQ(application.command(Command::kStart), Answer::kAccepted);
  }
  switch (mode) {
    case kStandby:
    case kWaitingForFix:
      fly_from(flight().samples, kNoFixes, 1, 20, application);
      break;
    case kAligning:
      fly_from(flight(), 1, 31, application);
      break;
    case kCalibrating:
      fly_from(flight(), 1, 300, application);
      break;
    case kNavigating:
      fly_from(flight(), 1, kAdopted_s, application);
      break;
    case kDegraded:
      fly_from(flight(), 1, 300, application);
      fly_from(flight().samples, kNoFixes, 300, 370, application);
      break;
    case kFailed:
      fly_from(flight(), 1, 300, application);
      fly_from(frozen(300, 370), flight().fixes, 300, 370, application);
      break;
  }
  EXPECT_EQ(application.mode(), mode);
  return application;
}

/// A record without what a refused command changes.
Housekeeping without_commands(Housekeeping record) {
  record.commands_accepted = record.commands_refused = 0;
  record.last_answer = 0;
  return record;
}
bool same(const Housekeeping& a, const Housekeeping& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Whether two applications are the same and go on in the same way, commands apart.
bool same_from(double t_s, PairApplication a, PairApplication b) {
  bool are = same(without_commands(a.housekeeping()), without_commands(b.housekeeping()));
  for (PairApplication* its : {&a, &b}) {
    fly_from(flight(), t_s, t_s + 10, *its);
  }
  return are && same(without_commands(a.housekeeping()), without_commands(b.housekeeping()));
}
double end_of(const PairApplication& application) {
  return to_seconds(Duration(application.housekeeping().time_ns)) + 0.125;
}

double error_rad(const PairApplication& application) {
  const auto sample = static_cast<std::size_t>(std::lround(8 * (end_of(application) - 0.125)));
  return test::attitude_error(flight().C_in_c_at_samples[sample], *application.attitude()).norm();
}

// ---- Transitions

TEST(Transitions, AreTheseAndNoOthers) {
  using enum Event;
  const std::set<std::tuple<Mode, Event, Mode>> allowed = {
      {kStandby, kStart, kWaitingForFix},
      {kCalibrating, kCorrectNow, kCalibrating},
      {kNavigating, kCorrectNow, kNavigating},
      {kDegraded, kCorrectNow, kDegraded},
      {kCalibrating, kAdoptCalibration, kCalibrating},
      {kNavigating, kAdoptCalibration, kNavigating},
      {kDegraded, kAdoptCalibration, kDegraded},
      {kCalibrating, kHoldCalibration, kCalibrating},
      {kNavigating, kHoldCalibration, kNavigating},
      {kDegraded, kHoldCalibration, kDegraded},
      {kAligning, kSelectGyros, kAligning},
      {kCalibrating, kSelectGyros, kCalibrating},
      {kNavigating, kSelectGyros, kNavigating},
      {kDegraded, kSelectGyros, kDegraded},
      {kStandby, kLoadParameters, kStandby},
      {kStandby, kReset, kStandby},
      {kWaitingForFix, kReset, kStandby},
      {kAligning, kReset, kStandby},
      {kCalibrating, kReset, kStandby},
      {kNavigating, kReset, kStandby},
      {kDegraded, kReset, kStandby},
      {kFailed, kReset, kStandby},
      {kWaitingForFix, kFirstFix, kAligning},
      {kAligning, kAligned, kCalibrating},
      {kCalibrating, Event::kAdopted, kNavigating},
      {kNavigating, kTakenBack, kCalibrating},
      {kCalibrating, kFilterRestarted, kAligning},
      {kNavigating, kFilterRestarted, kAligning},
      {kDegraded, kFilterRestarted, kAligning},
      {kCalibrating, kFault, kDegraded},
      {kNavigating, kFault, kDegraded},
      {kDegraded, kRecovered, kCalibrating},
      {kWaitingForFix, kFailure, kFailed},
      {kAligning, kFailure, kFailed},
      {kCalibrating, kFailure, kFailed},
      {kNavigating, kFailure, kFailed},
      {kDegraded, kFailure, kFailed},
  };
  std::size_t found = 0;
  for (const Mode mode : all_modes()) {
    for (std::size_t event = 0; event < kEvents; ++event) {
      if (const auto next = next_mode(mode, static_cast<Event>(event))) {
        ++found;
        EXPECT_TRUE(allowed.contains({mode, static_cast<Event>(event), *next}))
            << static_cast<int>(mode) << ' ' << event << ' ' << static_cast<int>(*next);
      }
    }
  }
  EXPECT_EQ(found, allowed.size());
}

// ---- Commands

TEST(Commands, AreAcceptedInTheirModesAndChangeNothingInOthers) {
  const std::pair<Command, std::set<Mode>> kAccepted[] = {
      {Command::kStart, {kStandby}},
      {Command::kCorrectNow, {kCalibrating, kNavigating, kDegraded}},
      {Command::kAdoptCalibration, {kCalibrating, kNavigating, kDegraded}},
      {Command::kHoldCalibration, {kCalibrating, kNavigating, kDegraded}},
      {Command::kSelectGyros, {kAligning, kCalibrating, kNavigating, kDegraded}},
      {Command::kReset, {kStandby, kWaitingForFix, kAligning, kCalibrating, kNavigating, kDegraded, kFailed}},
  };
  for (const Mode mode : all_modes()) {
    const PairApplication before = application_in(mode);
    const double t_s = end_of(before);
    for (const auto& [command, modes] : kAccepted) {
      PairApplication after = before;
      const Answer answer = after.command(command, 0b11);
      const auto what = std::to_string(static_cast<int>(mode)) + ' ' + std::to_string(static_cast<int>(command));
      EXPECT_EQ(answer, modes.contains(mode) ? Answer::kAccepted : Answer::kNotInThisMode) << what;
      EXPECT_EQ(after.housekeeping().last_answer, static_cast<std::uint8_t>(answer)) << what;
      if (answer != Answer::kAccepted) {
        EXPECT_EQ(after.housekeeping().commands_refused, before.housekeeping().commands_refused + 1) << what;
        EXPECT_TRUE(same_from(t_s, before, after)) << what;
      }
    }
    PairApplication after = before;
    Parameters table = test::nominal_parameters();
    table.required_error_rad *= 2;
    EXPECT_EQ(after.load(table), mode == kStandby ? Answer::kAccepted : Answer::kNotInThisMode);
    EXPECT_EQ(same_from(t_s, before, after), mode != kStandby);
  }
}

TEST(Commands, HaveTheirReasonsOfRefusal) {
  PairApplication empty;
  EXPECT_EQ(empty.command(Command::kStart), Answer::kNoParameters);
  EXPECT_EQ(empty.mode(), kStandby);
  const Housekeeping nothing = empty.housekeeping();
  EXPECT_EQ(empty.on_gyro(flight().samples[0]).sample, SampleStatus::kNone);
  EXPECT_TRUE(same(empty.housekeeping(), nothing));
  EXPECT_EQ(empty.command(Command::kReset), Answer::kAccepted);
  const PairApplication before = application_in(kCalibrating);
  const auto refused = [&](Command command, std::uint32_t argument) {
    PairApplication after = before;
    const Answer answer = after.command(command, argument);
    EXPECT_TRUE(same_from(300, before, after));
    return answer;
  };
  EXPECT_EQ(refused(static_cast<Command>(kCommands), 0), Answer::kUnknownCommand);
  EXPECT_EQ(refused(static_cast<Command>(255), 0), Answer::kUnknownCommand);
  EXPECT_EQ(refused(Command::kLoadParameters, 0), Answer::kUnknownCommand);
  EXPECT_EQ(refused(Command::kSelectGyros, 0b01), Answer::kTooFewGyros);
  EXPECT_EQ(refused(Command::kSelectGyros, 0), Answer::kTooFewGyros);
  EXPECT_EQ(refused(Command::kSelectGyros, 0b101), Answer::kNoSuchGyro);
  EXPECT_EQ(refused(Command::kSelectGyros, 0xFFFFFFFF), Answer::kNoSuchGyro);

  const auto young = test::started<PairApplication>(test::nominal_parameters());
  fly_from(flight(), 0, 120, *young);
  EXPECT_EQ(young->mode(), kCalibrating);
  EXPECT_EQ(young->command(Command::kAdoptCalibration), Answer::kResidualsDisagree);
}

TEST(Commands, SelectOnlyGyrosThatGiveAnAttitude) {
  // The third rotor turns about the axis of the first.
  const auto samples = test::with_third_gyro(flight(), Eigen::Vector3d(0.51, 0.59, 0.63).normalized(), 1);
  const auto application = test::started<TrioApplication>(test::nominal_parameters(3));
  fly_from(samples, flight().fixes, 0, 100, *application);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b101), Answer::kMomentaNearlyParallel);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b110), Answer::kAccepted);
  EXPECT_EQ(application->housekeeping().gyros[0], TRIHEDRON_GYRO_NOT_SELECTED);
}

// ---- Parameters

TEST(ParameterTable, WithAnythingWrongIsRefusedAndNothingIsChanged) {
  struct Case {
    const char* name;
    Answer answer;
    void (*spoil)(Parameters& table);
  };
  const auto at = [](int i) { return test::covariance_index(i, i); };
  static const auto kDiagonal3 = at(3);
  const Case cases[] = {
      {"version", Answer::kWrongVersion, [](Parameters& table) { ++table.version; }},
      {"version 0", Answer::kWrongVersion, [](Parameters& table) { table.version = 0; }},
      {"one gyro", Answer::kTooLarge, [](Parameters& table) { table.gyros = 1; }},
      {"three gyros", Answer::kTooLarge, [](Parameters& table) { table.gyros = 3; }},
      {"so many gyros", Answer::kTooLarge, [](Parameters& table) { table.gyros = 0xFFFFFFFF; }},
      {"period 0", Answer::kNotPositive, [](Parameters& table) { table.gyro_period_ns = 0; }},
      {"period of centuries", Answer::kNotPositive, [](Parameters& table) { table.gyro_period_ns = INT64_MAX; }},
      {"negative interval", Answer::kNotPositive, [](Parameters& table) { table.correction_interval_ns = -1; }},
      {"angles after centuries", Answer::kNotPositive,
       [](Parameters& table) { table.angles_after_ns = INT64_MAX - 1; }},
      {"negative angles", Answer::kNotPositive, [](Parameters& table) { table.angles_after_ns = INT64_MIN; }},
      {"required interval 0", Answer::kNotPositive, [](Parameters& table) { table.required_interval_ns = 0; }},
      {"window of centuries", Answer::kNotPositive, [](Parameters& table) { table.window_ns = INT64_MAX; }},
      {"timeout", Answer::kNotPositive, [](Parameters& table) { table.star_tracker_timeout_ns = -5; }},
      {"failure", Answer::kNotPositive, [](Parameters& table) { table.failed_after_ns = 0; }},
      {"required error", Answer::kNotPositive, [](Parameters& table) { table.required_error_rad = kNaN; }},
      {"no error required", Answer::kNotPositive, [](Parameters& table) { table.required_error_rad = kInfinity; }},
      {"readout noise", Answer::kNotPositive, [](Parameters& table) { table.readout_noise_rad[1] = kNaN; }},
      {"readout noise 0", Answer::kNotPositive, [](Parameters& table) { table.readout_noise_rad[0] = 0; }},
      {"star tracker", Answer::kNotPositive, [](Parameters& table) { table.star_tracker_noise_rad[2] = kNaN; }},
      {"walk", Answer::kNotPositive, [](Parameters& table) { table.direction_random_walk_rad_sqrt_s = kNaN; }},
      {"gate", Answer::kNotPositive, [](Parameters& table) { table.gate_nis = kNaN; }},
      {"open gate", Answer::kNotPositive, [](Parameters& table) { table.gate_nis = kInfinity; }},
      {"reopening", Answer::kNotPositive, [](Parameters& table) { table.reopen_after_rejections = 0; }},
      {"jump", Answer::kNotPositive, [](Parameters& table) { table.reopen_after_jump_rejections = 0; }},
      {"aligned at once", Answer::kNotPositive, [](Parameters& table) { table.aligned_after_fixes = 0; }},
      {"drift", Answer::kMeanNotUsable, [](Parameters& table) { table.drift_rad_s[1][6] = kNaN; }},
      {"alignment", Answer::kMeanNotUsable, [](Parameters& table) { table.alignment_rad[0][2] = kInfinity; }},
      {"variance 0", Answer::kCovarianceNotPositiveDefinite,
       [](Parameters& table) { table.covariance[kDiagonal3] = 0; }},
      {"variance NaN", Answer::kCovarianceNotPositiveDefinite,
       [](Parameters& table) { table.covariance[kDiagonal3] = kNaN; }},
      {"covariance NaN", Answer::kCovarianceNotPositiveDefinite,
       [](Parameters& table) { table.covariance[kDiagonal3 - 1] = kNaN; }},
  };
  const PairApplication before = application_in(kStandby);
  for (const Case& its : cases) {
    Parameters table = test::nominal_parameters();
    its.spoil(table);
    PairApplication after = before;
    EXPECT_EQ(after.load(table), its.answer) << its.name;
    EXPECT_EQ(after.mode(), kStandby);
    PairApplication twin = before;
    EXPECT_EQ(after.command(Command::kStart), Answer::kAccepted);
    EXPECT_EQ(twin.command(Command::kStart), Answer::kAccepted);
    EXPECT_TRUE(same_from(20, twin, after)) << its.name;
  }
}

TEST(ParameterTable, MayKeepTheAnglesFromBeingUsed) {
  Parameters table = test::nominal_parameters();
  table.angles_after_ns = INT64_MAX;
  const auto application = test::started<PairApplication>(table);
  int by_angles = 0;
  const auto count = [&](const StepReport& report) { by_angles += report.angles.status != FixStatus::kNone ? 1 : 0; };
  fly_from(flight(), 0, 60, *application, count);
  fly_from(flight().samples, kNoFixes, 60, 300, *application, count);
  EXPECT_EQ(by_angles, 0);
}

TEST(ParameterTable, SaysTheSameAsTheSetUp) {
  // Means and a covariance of the full kind, by the table and by what it stands for.
  Parameters table = test::nominal_parameters();
  test::PairGiven given;
  const int size = Layout{}.parameters();
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < 7; ++i) {
      given.prior[k].drift_rad_s(i) = table.drift_rad_s[k][i] = 1e-7 * (i + 1 - 5 * k);
    }
    const Eigen::Vector3d alignment(1e-3, -2e-3 * k, 3e-3);
    given.prior[k].C_c_b = test::turn(alignment);
    Eigen::Map<Eigen::Vector3d>(table.alignment_rad[k]) = alignment;
  }
  const Eigen::VectorXd correlated = given.covariance.diagonal().cwiseSqrt() / 2;
  given.covariance += correlated * correlated.transpose();
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      table.covariance[test::covariance_index(i, j)] = given.covariance(i, j);
    }
  }
  const auto by_table = test::started<PairApplication>(table);
  PairApplication by_set_up;
  ApplicationPolicy policy;
  policy.required_interval = policy.window = std::chrono::minutes(20);
  policy.required_error_rad = 300 * kArcsecond;
  EXPECT_EQ(by_set_up.load(given.setup, given.prior, given.covariance, policy), Answer::kAccepted);
  EXPECT_EQ(by_set_up.command(Command::kStart), Answer::kAccepted);
  EXPECT_TRUE(same_from(0, *by_table, by_set_up));
}

TEST(SetUp, WithAnythingWrongIsRefusedAsATableIs) {
  const test::PairGiven given;
  const auto load = [&](PairApplication& application, const CalibrationSetup& setup, const ApplicationPolicy& policy) {
    return application.load(setup, given.prior, given.covariance, policy);
  };
  PairApplication standby = application_in(kStandby);
  CalibrationSetup of_three = given.setup;
  of_three.layout.gyros = 3;
  EXPECT_EQ(load(standby, of_three, {}), Answer::kTooLarge);
  EXPECT_EQ(load(standby, given.setup, {.spread_over = -1}), Answer::kNotPositive);
  EXPECT_EQ(load(standby, given.setup, {.spread_over = 0}), Answer::kAccepted);
  const PairApplication before = application_in(kCalibrating);
  PairApplication after = before;
  EXPECT_EQ(load(after, given.setup, {}), Answer::kNotInThisMode);
  EXPECT_TRUE(same_from(end_of(before), before, after));
}

// ---- Adoption

TEST(Adoption, IsTheSameWhereTheWorkOfAFixIsSpread) {
  const test::PairGiven given;
  const test::Flight its({.duration_s = 1800, .fix_offset_s = 0.03, .fix_jitter_s = 0.5});
  const auto flown = [&](int spread_over) {
    ApplicationPolicy policy;
    policy.required_interval = policy.window = std::chrono::minutes(20);
    policy.required_error_rad = 300 * kArcsecond;
    policy.spread_over = spread_over;
    auto application = std::make_unique<PairApplication>();
    EXPECT_EQ(application->load(given.setup, given.prior, given.covariance, policy), Answer::kAccepted);
    EXPECT_EQ(application->command(Command::kStart), Answer::kAccepted);
    fly_from(its, 0, 1790, *application);
    fly_from(its.samples, test::kNoFixes, 1790, 1e9, *application);
    return application;
  };
  const auto at_once = flown(1);
  const auto spread = flown(20);
  EXPECT_EQ(spread->mode(), kNavigating);
  EXPECT_TRUE(same(spread->housekeeping(), at_once->housekeeping()));
  EXPECT_EQ(spread->forecast().error_rad(), at_once->forecast().error_rad());
  EXPECT_EQ(spread->forecast().ready_s(), at_once->forecast().ready_s());
}

TEST(Adoption, ComesByItselfAndThenTheAttitudeKeepsWhatIsPredicted) {
  // Over flights with other noise, twenty minutes without the star tracker, at whatever attitude they end.
  constexpr int kFlights = 12;
  double sum_of_squares = 0;
  for (unsigned seed = 1; seed <= kFlights; ++seed) {
    const test::Flight its({.duration_s = 2700, .seed = seed});
    const auto application = test::started<PairApplication>(test::nominal_parameters());
    fly_from(its, 0, 1170, *application);
    EXPECT_EQ(application->mode(), kCalibrating);
    EXPECT_EQ(application->housekeeping().predicted, 0);
    fly_from(its, 1170, kAdopted_s, *application);
    const Housekeeping record = application->housekeeping();
    EXPECT_EQ(application->mode(), kNavigating);
    EXPECT_EQ(record.adoptions, 1U);
    EXPECT_EQ(record.adopted, 1);
    EXPECT_GE(record.ready_s, record.required_s);
    fly_from(its.samples, kNoFixes, kAdopted_s, kAdopted_s + record.required_s, *application);
    EXPECT_EQ(application->mode(), kNavigating);
    EXPECT_TRUE(application->has(Fault::kStarTrackerLost));
    const auto sample = static_cast<std::size_t>(8 * (kAdopted_s + record.required_s)) - 1;
    const double error = test::attitude_error(its.C_in_c_at_samples[sample], *application->attitude()).norm();
    EXPECT_LT(error, record.predicted_error_rad) << seed;
    sum_of_squares += error * error / (record.predicted_error_rad * record.predicted_error_rad);
  }
  // The prediction is of 99.7 % for the worst attitude: about three sigma. It is not several times too large.
  EXPECT_GT(std::sqrt(sum_of_squares / kFlights), 0.1);
}

TEST(Adoption, WaitsForTheRequiredErrorAndNotForACommand) {
  Parameters table = test::nominal_parameters();
  table.required_error_rad = 1 * kArcsecond;
  const auto application = test::started<PairApplication>(table);
  fly_from(flight(), 0, kAdopted_s, *application);
  EXPECT_EQ(application->mode(), kCalibrating);
  EXPECT_GT(application->housekeeping().predicted_error_rad, table.required_error_rad);
  EXPECT_LT(application->housekeeping().ready_s, application->housekeeping().required_s);
  const double before_rad = error_rad(*application);
  EXPECT_EQ(application->command(Command::kAdoptCalibration), Answer::kAccepted);
  EXPECT_EQ(application->housekeeping().adopted, 0);
  fly_from(flight(), kAdopted_s, kAdopted_s + 6, *application);
  EXPECT_EQ(application->housekeeping().adopted, 1);
  EXPECT_EQ(application->mode(), kNavigating);
  EXPECT_LT(error_rad(*application), before_rad);
}

using Attitudes = std::map<Time, Eigen::Matrix3d>;

/// Goes on from `from_s` to `to_s`; the attitude after each sample.
Attitudes attitudes(double from_s, double to_s, PairApplication& application) {
  Attitudes found;
  fly_from(flight(), from_s, to_s, application, [&](const StepReport& report) {
    if (const auto attitude = application.attitude(); attitude && report.sample == SampleStatus::kUsed) {
      found[report.t] = attitude->C_in_c.raw();
    }
  });
  return found;
}

/// Corrected at each fix, whose work is spread over all samples up to the next one.
PairApplication corrected_at_each_fix() {
  Parameters table = test::nominal_parameters();
  table.required_error_rad = 1 * kArcsecond;  // nothing is adopted by itself
  table.correction_interval_ns = 1;
  table.spread_over = 1000;
  PairApplication application;
  EXPECT_EQ(application.load(table), Answer::kAccepted);
  EXPECT_EQ(application.command(Command::kStart), Answer::kAccepted);
  fly_from(flight(), 0, 600, application);
  return application;
}

TEST(Adoption, CommandedWhileACorrectionIsUnderWayIsDoneByTheNextOne) {
  const PairApplication begun = corrected_at_each_fix();
  PairApplication before = begun;
  EXPECT_EQ(before.command(Command::kAdoptCalibration), Answer::kAccepted);
  const Attitudes adopted = attitudes(600, 620, before);
  for (int samples = 0; samples < 24; ++samples) {
    const double commanded_s = 606 + samples / 8.0;
    PairApplication application = begun;
    fly_from(flight(), 600, commanded_s, application);
    EXPECT_EQ(application.command(Command::kAdoptCalibration), Answer::kAccepted);
    for (double t_s = commanded_s; t_s < 618; t_s += 0.125) {
      const Attitudes now = attitudes(t_s, t_s + 0.125, application);
      if (application.housekeeping().adopted != 0) {
        ASSERT_EQ(now.size(), 1U);
        EXPECT_EQ(now.begin()->second, adopted.at(now.begin()->first)) << samples << " " << t_s;
      } else {  // once more, which gives up no correction by the same parameters
        EXPECT_EQ(application.command(Command::kAdoptCalibration), Answer::kAccepted);
      }
    }
    EXPECT_EQ(application.housekeeping().adopted, 1) << samples;
  }
}

TEST(Hold, WhileTheCorrectionOfAnAdoptionIsUnderWayGivesItUp) {
  const PairApplication begun = corrected_at_each_fix();
  PairApplication before = begun;
  EXPECT_EQ(before.command(Command::kHoldCalibration), Answer::kAccepted);
  const Attitudes held = attitudes(600, 620, before);
  int given_up = 0;
  int done = 0;
  for (int samples = 0; samples < 48; ++samples) {
    const double commanded_s = 605.25 + samples / 8.0;
    PairApplication application = begun;
    fly_from(flight(), 600, 605, application);
    EXPECT_EQ(application.command(Command::kAdoptCalibration), Answer::kAccepted);
    fly_from(flight(), 605, commanded_s, application);
    if (application.housekeeping().adopted != 0) {
      continue;
    }
    EXPECT_EQ(application.command(Command::kHoldCalibration), Answer::kAccepted);
    const bool is_done = application.housekeeping().adopted != 0;
    ++(is_done ? done : given_up);

    fly_from(flight(), commanded_s, 616, application);
    EXPECT_EQ(application.housekeeping().adopted, is_done ? 1 : 0) << samples;
    for (const auto& [t, attitude] : attitudes(616, 618, application)) {
      EXPECT_EQ(attitude == held.at(t), !is_done) << samples;
    }
  }
  EXPECT_GT(given_up, 1);
  EXPECT_GT(done, 0);  // the navigator has been corrected, and the report of it was still to come
}

/// A case that has been moved: a gyro reads everything turned, from 1500 s on.
std::vector<GyroSample> moved_at_1500_s(std::vector<GyroSample> samples = flight().samples, int gyro = 0) {
  for (std::size_t i = 8 * 1500; i < samples.size(); ++i) {
    samples[i].h_b[gyro] = test::turn(0.002, -0.001, 0.002) * samples[i].h_b[gyro];
  }
  return samples;
}

TEST(Adoption, IsJudgedByMisfitsOfTheOpenLoopOverTheirSigmas) {
  Parameters table = test::nominal_parameters();
  table.correction_interval_ns = Duration(std::chrono::hours(1)).count();
  const auto application = test::started<PairApplication>(table);
  fly_from(flight(), 0, 3500, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  EXPECT_NEAR(application->housekeeping().navigation_ratio, 1, 0.5);  // of a hundred, which share the navigator's error
}

TEST(Adoption, IsTakenBackWhenResidualsDisagree) {
  const auto samples = moved_at_1500_s();
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 1500, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  const double sigma_rad = application->housekeeping().sigma_rad[0];
  for (double t_s = 1500; application->housekeeping().withdrawals == 0 && t_s < 3000; t_s += 3) {
    fly_from(samples, flight().fixes, t_s, t_s + 3, *application);
  }
  fly_from(samples, flight().fixes, end_of(*application), end_of(*application) + 7, *application);
  const Housekeeping record = application->housekeeping();
  EXPECT_EQ(record.withdrawals, 1U);
  EXPECT_EQ(record.adopted, 0);
  // Back to the parameters known before, with their sigmas.
  EXPECT_GT(record.sigma_rad[0], 2 * sigma_rad);
  EXPECT_EQ(application->on_board().navigator().gyros()[0].drift_rad_s,
            application->on_board().estimator().prior_gyros()[0].drift_rad_s);
}

/// A soft error in the memory of the estimate: no longer a covariance.
void spoil_covariance(PairApplication& application) {
  const_cast<double&>(application.on_board().estimator().errors().root()(25, 25)) = kNaN;
}

TEST(Adoption, ThatIsStillToComeIsDroppedWhenTheEstimateIsLost) {
  PairApplication application = application_in(kCalibrating);
  fly_from(flight(), 300, 600, application);
  EXPECT_EQ(application.command(Command::kAdoptCalibration), Answer::kAccepted);
  spoil_covariance(application);
  fly_from(flight(), 600, 620, application);
  const Housekeeping record = application.housekeeping();
  EXPECT_EQ(record.filter_restarts, 1U);
  EXPECT_EQ(record.adoptions, 0U);
  EXPECT_EQ(record.withdrawals, 0U);  // nothing had been adopted
  EXPECT_EQ(record.adopted, 0);
  EXPECT_EQ(application.mode(), kAligning);
  EXPECT_EQ(application.on_board().corrected_by(), ParametersInUse::kOfSetUp);
  EXPECT_GT(application.on_board().corrected_t(), Time(std::chrono::seconds(600)));
}

TEST(Adoption, IsTakenBackWhenTheNavigatorLeavesTheFixes) {
  // The filter follows a drift that changes slowly; the navigator, corrected once in forty minutes, does not.
  Parameters table = test::nominal_parameters();
  table.correction_interval_ns = Duration(std::chrono::minutes(40)).count();
  table.direction_random_walk_rad_sqrt_s = 1e-6;
  const auto application = test::started<PairApplication>(table);
  std::vector<GyroSample> samples = flight().samples;
  std::vector<StarFix> fixes = flight().fixes;
  for (StarFix& fix : fixes) {
    const double away_s = std::max(to_seconds(fix.t.time_since_epoch()) - 1500, 0.0);
    fix.q_in_c = Eigen::Quaterniond(Eigen::AngleAxisd(1e-6 * away_s, Eigen::Vector3d::UnitX())) * fix.q_in_c;
  }
  fly_from(samples, fixes, 0, 1500, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  fly_from(samples, fixes, 1500, 3600, *application);
  EXPECT_GE(application->housekeeping().withdrawals, 1U);
}

TEST(Hold, KeepsTheParametersAndTheirHonestSigmas) {
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(flight(), 0, kAdopted_s, *application);
  EXPECT_EQ(application->command(Command::kHoldCalibration), Answer::kAccepted);
  const auto held = application->on_board().navigator().gyros();
  const auto estimated = application->on_board().estimator().gyros();
  fly_from(flight(), kAdopted_s, 3000, *application);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(application->on_board().navigator().gyros()[k].drift_rad_s, held[k].drift_rad_s);
    EXPECT_EQ(application->on_board().navigator().gyros()[k].C_c_b, held[k].C_c_b);
    EXPECT_NE(application->on_board().estimator().gyros()[k].drift_rad_s, estimated[k].drift_rad_s);
  }
  EXPECT_EQ(application->housekeeping().held, 1);
  // Corrected at each fix, twenty minutes open-loop: the sigmas hold both.
  const auto ratio = [&] {
    const Eigen::Matrix3d P = application->attitude()->covariance_rad2;
    return error_rad(*application) / std::sqrt(P.trace());
  };
  EXPECT_LT(ratio(), 3);
  fly_from(flight().samples, kNoFixes, 3000, 4200, *application);
  EXPECT_LT(ratio(), 3);
  EXPECT_GT(ratio(), 0.05);
}

TEST(Hold, NeitherAdoptsNorTakesBack) {
  const auto waiting = test::started<PairApplication>(test::nominal_parameters());
  fly_from(flight(), 0, 600, *waiting);
  EXPECT_EQ(waiting->command(Command::kHoldCalibration), Answer::kAccepted);
  fly_from(flight(), 600, 1800, *waiting);
  EXPECT_EQ(waiting->mode(), kCalibrating);
  EXPECT_EQ(waiting->command(Command::kAdoptCalibration), Answer::kAccepted);
  fly_from(flight(), 1800, 1806, *waiting);
  EXPECT_EQ(waiting->mode(), kNavigating);

  const auto samples = moved_at_1500_s();
  const auto adopted = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 1500, *adopted);
  EXPECT_EQ(adopted->command(Command::kHoldCalibration), Answer::kAccepted);
  fly_from(samples, flight().fixes, 1500, 2100, *adopted);
  EXPECT_EQ(adopted->housekeeping().withdrawals, 0U);
  EXPECT_EQ(adopted->housekeeping().adopted, 1);
}

TEST(CorrectNow, CorrectsAtTheNextFixWhateverTheInterval) {
  Parameters table = test::nominal_parameters();
  table.correction_interval_ns = Duration(std::chrono::hours(1)).count();
  const auto application = test::started<PairApplication>(table);
  fly_from(flight(), 0, 300, *application);
  EXPECT_EQ(application->housekeeping().corrections, 1U);
  EXPECT_EQ(application->command(Command::kCorrectNow), Answer::kAccepted);
  fly_from(flight(), 300, 306, *application);  // the next one comes, and its work is spread over three seconds
  EXPECT_EQ(application->housekeeping().corrections, 2U);
  fly_from(flight(), 306, 400, *application);
  EXPECT_EQ(application->housekeeping().corrections, 2U);
}

// ---- Faults

TEST(StarTrackerLost, DegradesOnlyWhereTheCalibrationIsNotAdopted) {
  PairApplication calibrating = application_in(kDegraded);
  EXPECT_EQ(calibrating.faults(), TRIHEDRON_FAULT_STAR_TRACKER_LOST);
  EXPECT_TRUE(calibrating.attitude());
  fly_from(flight(), 370, 380, calibrating);
  EXPECT_EQ(calibrating.mode(), kCalibrating);
  EXPECT_EQ(calibrating.faults(), 0U);
}

TEST(StarTrackerLost, DegradesAnAdoptedCalibrationAfterItsReadiness) {
  Parameters table = test::nominal_parameters();
  table.required_interval_ns =
      Duration(std::chrono::minutes(2)).count();  // the readiness is looked for up to 8 minutes
  const auto application = test::started<PairApplication>(table);
  fly_from(flight(), 0, kAdopted_s, *application);
  const double ready_s = application->housekeeping().ready_s;
  EXPECT_GT(ready_s, 470);
  fly_from(flight().samples, kNoFixes, kAdopted_s, kAdopted_s + ready_s - 5, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  fly_from(flight().samples, kNoFixes, kAdopted_s + ready_s - 5, kAdopted_s + ready_s + 5, *application);
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_TRUE(application->has(Fault::kAccuracy));
  fly_from(flight(), kAdopted_s + ready_s + 5, kAdopted_s + ready_s + 15, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  EXPECT_EQ(application->faults(), 0U);
}

TEST(GyroLost, OfThreeDegradesUntilTheOthersAreSelected) {
  auto samples = test::with_third_gyro(flight(), Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1);
  for (std::size_t i = 8 * 400; i < samples.size(); ++i) {
    samples[i].h_b[2] = samples[8 * 400].h_b[2];
  }
  const auto application = test::started<TrioApplication>(test::nominal_parameters(3));
  fly_from(samples, flight().fixes, 0, 400, *application);
  EXPECT_EQ(application->mode(), kCalibrating);
  fly_from(samples, flight().fixes, 400, 420, *application);
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_EQ(application->faults(), TRIHEDRON_FAULT_GYRO_LOST);
  EXPECT_EQ(application->housekeeping().gyros[2], TRIHEDRON_GYRO_STUCK);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b011), Answer::kAccepted);
  fly_from(samples, flight().fixes, 420, 1500, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b111), Answer::kAccepted);
  fly_from(samples, flight().fixes, 1500, 1503, *application);
  EXPECT_EQ(application->mode(), kDegraded);
}

TEST(GyroLost, WhoseRotorSpinsDownIsLeftOutAndCanBeTakenBack) {
  auto samples = test::with_third_gyro(flight(), Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1);
  // A rotor without momentum is turned by its suspension: it moves away at a hundred times the usual drift.
  for (std::size_t i = 8 * 400; i < samples.size(); ++i) {
    const double away_s = static_cast<double>(i) / 8 - 400;
    samples[i].h_b[2] = test::turn(0, 1e-3 * away_s, 0) * samples[i].h_b[2];
  }
  const auto application = test::started<TrioApplication>(test::nominal_parameters(3));
  fly_from(samples, flight().fixes, 0, 600, *application);
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_EQ(application->housekeeping().gyros[2], TRIHEDRON_GYRO_ISOLATED);
  EXPECT_EQ(application->housekeeping().filter_restarts, 0U);
  EXPECT_LT(test::attitude_error(flight().C_in_c_at_samples[8 * 600 - 1], *application->attitude()).norm(),
            60 * kArcsecond);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b111), Answer::kAccepted);
  EXPECT_EQ(application->housekeeping().gyros[2], TRIHEDRON_GYRO_USED);
}

TEST(NoAttitude, ForShortDegradesAndForLongFails) {
  const auto samples = frozen(300, 330);
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 310, *application);
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_TRUE(application->has(Fault::kNoAttitude));
  EXPECT_FALSE(application->attitude());
  EXPECT_EQ(application->housekeeping().attitude_valid, 0);
  fly_from(samples, flight().fixes, 310, 360, *application);
  EXPECT_EQ(application->mode(), kCalibrating);
  EXPECT_TRUE(application->attitude());

  PairApplication failed = application_in(kFailed);
  const auto ignored = failed.housekeeping().fixes_ignored;
  EXPECT_EQ(failed.on_gyro(flight().samples[8 * 400]).sample, SampleStatus::kNone);
  EXPECT_EQ(failed.on_fix(flight().fixes[140]).fix.status, FixStatus::kNone);
  EXPECT_EQ(failed.housekeeping().fixes_ignored, ignored + 1);
  EXPECT_EQ(failed.command(Command::kReset), Answer::kAccepted);
  EXPECT_EQ(failed.command(Command::kStart), Answer::kAccepted);
  fly_from(flight(), 400, 700, failed);
  EXPECT_EQ(failed.mode(), kCalibrating);
}

TEST(NoAttitude, FailsInEachModeThatHasStarted) {
  for (const Mode mode : {kWaitingForFix, kAligning, kCalibrating, kNavigating, kDegraded}) {
    PairApplication application = application_in(mode);
    const double t_s = end_of(application);
    fly_from(frozen(t_s, t_s + 70), kNoFixes, t_s, t_s + 70, application);
    EXPECT_EQ(application.mode(), kFailed) << static_cast<int>(mode);
  }
}

TEST(NoAttitude, AtASpikeIsThatOfTheSampleAlone) {
  PairApplication application = application_in(kCalibrating);
  GyroSample spike = flight().samples[8 * 300];
  spike.h_b[1] = rotated<double>(spike.h_b[1], Eigen::Vector3d(0.017, 0, 0));
  EXPECT_EQ(application.on_gyro(spike).sample, SampleStatus::kUsed);
  EXPECT_FALSE(application.attitude());
  EXPECT_EQ(application.housekeeping().attitude_valid, 0);
  EXPECT_FALSE(application.has(Fault::kNoAttitude));
  application.on_gyro(flight().samples[8 * 300 + 1]);
  EXPECT_TRUE(application.attitude());
}

TEST(NoAttitude, OfTheNavigatorAtAFixSaysNothingAgainstIt) {
  // A fix that waits for the one before it. By its turn gyro 2 is known to have stuck just after it.
  Parameters table = test::nominal_parameters();
  table.correction_interval_ns = Duration(std::chrono::hours(1)).count();
  std::vector<StarFix> fixes(flight().fixes.begin(), flight().fixes.begin() + 101);  // until 300 s
  fixes.push_back({Time(from_seconds(300.5)), Eigen::Quaterniond(test::Flight::attitude(300.5, 0.5))});
  const auto application = test::started<PairApplication>(table);
  std::vector<double> ratios;
  fly_from(frozen(300.625, 310), fixes, 0, 310, *application, [&](const StepReport& report) {
    if (report.fix.t >= Time(std::chrono::seconds(300)) && report.fix.used()) {
      ratios.push_back(application->housekeeping().navigation_ratio);
    }
  });
  EXPECT_EQ(application->housekeeping().fixes_used, 102U);
  ASSERT_EQ(ratios.size(), 2U);
  EXPECT_EQ(ratios[1], ratios[0]);
}

TEST(NoAttitude, AfterHalfASecondWithoutADirection) {
  PairApplication application = application_in(kCalibrating);
  for (std::size_t i = 0; i < 6; ++i) {
    GyroSample sample = flight().samples[8 * 300 + i];
    sample.h_b[0].setConstant(kNaN);
    EXPECT_EQ(application.on_gyro(sample).sample, SampleStatus::kRejectedNotDirection);
    EXPECT_EQ(application.has(Fault::kNoAttitude), i >= 4) << i;  // 0.625 s after the last that was used
    EXPECT_EQ(application.attitude().has_value(), i < 4) << i;
  }
  application.on_gyro(flight().samples[8 * 300 + 6]);
  EXPECT_FALSE(application.has(Fault::kNoAttitude));
}

GyroSample without_directions(GyroSample sample) {
  sample.h_b[0].setConstant(kNaN);
  return sample;
}

/// A time without samples is none without attitude, nor is one that a single sample has wrong.
TEST(NoAttitude, FailsByNoSampleThatIsTheFirstOneForLong) {
  const auto begun = test::started<PairApplication>(test::nominal_parameters());
  GyroSample first = without_directions(flight().samples[0]);
  first.t += std::chrono::hours(24 * 365 * 50);
  EXPECT_EQ(begun->on_gyro(first).sample, SampleStatus::kRejectedNotDirection);
  EXPECT_EQ(begun->mode(), kWaitingForFix);

  // What was refused has told no time by which others would be late, or a gap.
  for (const bool are_good : {true, false}) {
    const auto application = test::started<PairApplication>(test::nominal_parameters());
    application->on_gyro(first);
    for (std::size_t i = 1; i < 8 * 70; ++i) {
      application->on_gyro(are_good ? flight().samples[i] : without_directions(flight().samples[i]));
    }
    EXPECT_EQ(application->mode(), are_good ? kWaitingForFix : kFailed);
    EXPECT_EQ(application->housekeeping().gaps, 0U);
  }

  PairApplication after_gap = application_in(kCalibrating);
  after_gap.on_gyro(without_directions(flight().samples[8 * 370]));
  fly_from(flight(), 370.125, 373, after_gap);
  EXPECT_NE(after_gap.mode(), kFailed);
  fly_from(flight(), 373, 380, after_gap);
  EXPECT_EQ(after_gap.mode(), kCalibrating);

  PairApplication ahead = application_in(kCalibrating);
  GyroSample wrong = without_directions(flight().samples[8 * 300]);
  wrong.t += std::chrono::seconds(90);
  ahead.on_gyro(wrong);
  EXPECT_EQ(ahead.faults(), 0U);
  fly_from(flight(), 300.125, 310, ahead);
  EXPECT_EQ(ahead.mode(), kCalibrating);
}

TEST(NoAttitude, FailsByAMinuteOfSamplesAfterAGap) {
  PairApplication application = application_in(kCalibrating);
  for (std::size_t i = 8 * 400; i < 8 * 459; ++i) {
    application.on_gyro(without_directions(flight().samples[i]));
  }
  EXPECT_EQ(application.mode(), kDegraded);
  for (std::size_t i = 8 * 459; i < 8 * 464; ++i) {
    application.on_gyro(without_directions(flight().samples[i]));
  }
  EXPECT_EQ(application.mode(), kFailed);
}

/// Largest error of the attitude in 1-sigmas, of all axes and all samples, at each of which there is one with sigmas
/// below this.
template <class Application>
double largest_in_sigmas(const std::vector<GyroSample>& samples, const std::vector<StarFix>& fixes, double from_s,
                         double to_s, double most_rad, Application& application) {
  double largest = 0;
  fly_from(samples, fixes, from_s, to_s, application, [&](const StepReport& report) {
    if (is_used(report.sample)) {
      const auto attitude = application.attitude();
      ASSERT_TRUE(attitude);
      const auto i = static_cast<std::size_t>(std::lround(8 * to_seconds(report.t.time_since_epoch())));
      const Eigen::Vector3d error = test::attitude_error(flight().C_in_c_at_samples[i], *attitude);
      const Eigen::Vector3d sigma_rad = attitude->covariance_rad2.diagonal().cwiseSqrt();
      EXPECT_LT(sigma_rad.maxCoeff(), most_rad);
      largest = std::max(largest, error.cwiseQuotient(sigma_rad).cwiseAbs().maxCoeff());
    }
  });
  return largest;
}

/// By the readings: an error of the fix has no part in it.
TEST(GyrosContradict, ByAnAngleWhoseSigmaIsTrue) {
  std::vector<StarFix> fixes = flight().fixes;
  const Time wrong_t{std::chrono::seconds(900)};
  std::ranges::find(fixes, wrong_t, &StarFix::t)->q_in_c *= Eigen::Quaterniond(test::turn(0.05, -0.1, 0.05));
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  double sum = 0;
  int count = 0;
  fly_from(flight().samples, fixes, 0, 1500, *application, [&](const StepReport& report) {
    if (report.fix.innovation.size() == 0) {
      return;
    }
    const double in_sigmas = report.fix.angle_off_rad / report.fix.angle_sigma_rad;
    EXPECT_LT(in_sigmas, 5);
    EXPECT_EQ(report.fix.status == FixStatus::kRejectedByGate, report.fix.t == wrong_t);
    sum += in_sigmas * in_sigmas;
    ++count;
  });
  EXPECT_EQ(count, 498);
  EXPECT_NEAR(sum / count, 1, 0.2);
}

/// Momenta whose angle is another than before: whatever the star tracker says, one of the gyros is wrong.
TEST(GyrosContradict, WithinASecondAndTheSigmasSaySo) {
  constexpr double kTenTimesTheAngle_rad = 0.03;
  // The angle does not show which way the momentum has gone: the sigmas are of the size of the error, no bound of it.
  constexpr double kSigmas = 5;
  const auto samples = moved_at_1500_s();
  for (const bool has_star_tracker : {true, false}) {
    const auto application = test::started<PairApplication>(test::nominal_parameters());
    fly_from(samples, flight().fixes, 0, 1500, *application);
    ASSERT_EQ(application->mode(), kNavigating);
    EXPECT_FALSE(application->has(Fault::kGyrosContradict));
    const auto& fixes = has_star_tracker ? flight().fixes : kNoFixes;
    fly_from(samples, fixes, 1500, 1501, *application);
    EXPECT_TRUE(application->has(Fault::kGyrosContradict));
    EXPECT_EQ(application->mode(), kDegraded);
    EXPECT_GT(application->attitude()->covariance_rad2.diagonal().minCoeff(), std::pow(kTenTimesTheAngle_rad / 2, 2));
    EXPECT_LT(largest_in_sigmas(samples, fixes, 1501, 1600, kTenTimesTheAngle_rad, *application), kSigmas);
    if (has_star_tracker) {  // twenty fixes are put down to it, and twenty more to the directions
      fly_from(samples, fixes, 1600, 1635, *application);
      EXPECT_FALSE(application->has(Fault::kGyrosContradict));
      EXPECT_FALSE(application->has(Fault::kFixesContradict));
      EXPECT_EQ(application->housekeeping().withdrawals, 1U);
    } else {
      EXPECT_TRUE(application->has(Fault::kGyrosContradict));
    }
  }
}

TEST(GyrosContradict, OfThreeUntilOneIsLeftOut) {
  constexpr double kTenTimesTheAngle_rad = 0.03;
  constexpr double kSigmas = 5;
  const auto samples =
      moved_at_1500_s(test::with_third_gyro(flight(), Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1), 2);
  const auto application = test::started<TrioApplication>(test::nominal_parameters(3));
  fly_from(samples, flight().fixes, 0, 1500, *application);
  ASSERT_EQ(application->mode(), kNavigating);
  fly_from(samples, flight().fixes, 1500, 1501, *application);
  EXPECT_TRUE(application->has(Fault::kGyrosContradict));
  EXPECT_LT(largest_in_sigmas(samples, flight().fixes, 1501, 1560, kTenTimesTheAngle_rad, *application), kSigmas);
  EXPECT_EQ(application->housekeeping().gyros[2], TRIHEDRON_GYRO_ISOLATED);
  EXPECT_FALSE(application->has(Fault::kGyrosContradict));
  EXPECT_LT(largest_in_sigmas(samples, flight().fixes, 1560, 2000, 60 * kArcsecond, *application), kSigmas);
  EXPECT_EQ(application->housekeeping().withdrawals, 0U);
}

/// Until then the attitude rests on what was wrong: however long the interval, and with parameters that are held.
TEST(GyrosContradict, UntilTheNavigatorHasBeenCorrected) {
  const auto samples = moved_at_1500_s();
  Parameters table = test::nominal_parameters();
  table.correction_interval_ns = Duration(std::chrono::hours(1)).count();
  const auto application = test::started<PairApplication>(table);
  fly_from(samples, flight().fixes, 0, 1400, *application);
  EXPECT_EQ(application->command(Command::kHoldCalibration), Answer::kAccepted);
  fly_from(samples, flight().fixes, 1400, 1501, *application);
  EXPECT_TRUE(application->has(Fault::kGyrosContradict));
  for (double t_s = 1501; application->has(Fault::kGyrosContradict) && t_s < 1700; t_s += 0.125) {
    fly_from(samples, flight().fixes, t_s, t_s + 0.125, *application);
  }
  EXPECT_FALSE(application->has(Fault::kGyrosContradict));
  EXPECT_GT(application->on_board().corrected_t(), Time(std::chrono::seconds(1550)));
}

/// Readings that come back: the navigator has gone along with the wrong ones.
TEST(GyrosContradict, UntilAFixWhereTheReadingsComeBack) {
  std::vector<GyroSample> samples = moved_at_1500_s();
  std::copy(flight().samples.begin() + 8 * 1510, flight().samples.end(), samples.begin() + 8 * 1510);
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 1500, *application);
  fly_from(samples, kNoFixes, 1500, 1530, *application);
  EXPECT_TRUE(application->has(Fault::kGyrosContradict));
  fly_from(samples, flight().fixes, 1530, 1540, *application);
  EXPECT_FALSE(application->has(Fault::kGyrosContradict));
}

/// Directions need not be of unit length to the last digit.
TEST(GyrosContradict, NotByTheLengthOfTheirReadings) {
  std::vector<GyroSample> samples = flight().samples;
  for (GyroSample& sample : samples) {
    sample.h_b[0] *= 1.0009;
    sample.h_b[1] *= 1.0009;
  }
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 1500, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  EXPECT_EQ(application->faults(), 0U);
}

/// A gap leaves what is known of the angle; it is not compared until a fix tells it again.
TEST(GyrosContradict, NotAfterAGapBeforeTheNextFix) {
  const auto samples = moved_at_1500_s();
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(samples, flight().fixes, 0, 1490, *application);
  fly_from(samples, kNoFixes, 1510, 1520, *application);
  EXPECT_FALSE(application->has(Fault::kGyrosContradict));
  EXPECT_TRUE(application->has(Fault::kGap));
  fly_from(samples, flight().fixes, 1520, 1530, *application);
  EXPECT_TRUE(application->has(Fault::kGyrosContradict));
  EXPECT_EQ(application->command(Command::kReset), Answer::kAccepted);
  EXPECT_EQ(application->faults(), 0U);
}

std::vector<StarFix> tilted_from_1500_s() {
  std::vector<StarFix> fixes = flight().fixes;
  for (StarFix& fix : fixes) {
    if (fix.t >= Time(std::chrono::seconds(1500))) {
      fix.q_in_c = fix.q_in_c * Eigen::Quaterniond(test::turn(0.001, -0.001, 0.001));
    }
  }
  return fixes;
}

/// A star tracker that is off by 6′ for twenty minutes and more: followed in the end, but not believed.
TEST(FixesContradict, UntilEnoughOfThemAgree) {
  const std::vector<StarFix> fixes = tilted_from_1500_s();
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  fly_from(flight().samples, fixes, 0, 1500, *application);
  ASSERT_EQ(application->mode(), kNavigating);
  fly_from(flight().samples, fixes, 1500, 1570, *application);
  EXPECT_TRUE(application->has(Fault::kFixesContradict));
  EXPECT_FALSE(application->has(Fault::kGyrosContradict));
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_LT(largest_in_sigmas(flight().samples, fixes, 1570, 2700, 0.004, *application), 3);
  EXPECT_EQ(application->mode(), kDegraded);
  EXPECT_EQ(application->housekeeping().adopted, 0);
  fly_from(flight().samples, fixes, 2700, 2850, *application);  // 400 of them, by now
  EXPECT_FALSE(application->has(Fault::kFixesContradict));
  EXPECT_NE(application->mode(), kDegraded);
}

/// Gyros that are not used have no part in how far the fixes are off.
TEST(FixesContradict, TheGyrosThatAreUsed) {
  const auto samples = test::with_third_gyro(flight(), Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1);
  const std::vector<StarFix> fixes = tilted_from_1500_s();
  for (const std::uint32_t selected : {0b011U, 0b110U}) {
    const auto application = test::started<TrioApplication>(test::nominal_parameters(3));
    fly_from(samples, fixes, 0, 100, *application);
    ASSERT_EQ(application->command(Command::kSelectGyros, selected), Answer::kAccepted);
    fly_from(samples, fixes, 100, 1570, *application);
    EXPECT_TRUE(application->has(Fault::kFixesContradict));
    EXPECT_LT(largest_in_sigmas(samples, fixes, 1570, 2000, 0.01, *application), 3);
  }
}

/// The second time soon after the first: the filter restarts, and as many have to agree from then on.
TEST(FixesContradict, AlsoAfterARestart) {
  std::vector<StarFix> fixes = flight().fixes;
  for (StarFix& fix : fixes) {
    const double times = fix.t >= Time(std::chrono::seconds(1650)) ? -1 : fix.t >= Time(std::chrono::seconds(1500));
    fix.q_in_c = fix.q_in_c * Eigen::Quaterniond(test::turn(times * 0.001, times * -0.001, times * 0.001));
  }
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  std::vector<FixStatus> followed;
  fly_from(flight().samples, fixes, 0, 1720, *application, [&](const StepReport& report) {
    if (report.fix.status == FixStatus::kUsedAfterReopening || report.fix.status == FixStatus::kRestarted) {
      followed.push_back(report.fix.status);
    }
  });
  ASSERT_GE(followed.size(), 2U);
  EXPECT_EQ(followed.front(), FixStatus::kUsedAfterReopening);
  EXPECT_EQ(followed.back(), FixStatus::kRestarted);
  EXPECT_LT(largest_in_sigmas(flight().samples, fixes, 1720, 2800, 0.01, *application), 3);
  EXPECT_TRUE(application->has(Fault::kFixesContradict));
  EXPECT_EQ(application->housekeeping().adopted, 0);
  fly_from(flight().samples, fixes, 2800, 2950, *application);
  EXPECT_FALSE(application->has(Fault::kFixesContradict));
}

TEST(NoAttitude, BeforeASampleHasBeenUsedByTheClockThatHasBeenSetBack) {
  PairApplication application = application_in(kCalibrating);
  std::vector<GyroSample> samples(flight().samples.begin() + 8 * 300, flight().samples.begin() + 8 * 300 + 20);
  for (GyroSample& sample : samples) {
    sample.t -= std::chrono::seconds(200);
  }
  samples[15].h_b[0].setZero();  // at the sixteenth the clock is taken to have been set back
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(application.on_gyro(samples[i]).sample,
              i < 15 ? SampleStatus::kRejectedOutOfOrder : SampleStatus::kRejectedNotDirection);
  }
  EXPECT_FALSE(application.attitude());
  EXPECT_FALSE(application.on_board().navigation_attitude());
  EXPECT_EQ(application.on_board().t(), samples[15].t);
  EXPECT_EQ(application.on_board().largest_angle_off_rad(), 0);
  EXPECT_EQ(application.housekeeping().attitude_valid, 0);
  EXPECT_EQ(application.command(Command::kSelectGyros, 0b11), Answer::kMomentaNearlyParallel);
  EXPECT_EQ(application.on_gyro(samples[16]).sample, SampleStatus::kUsedAfterClockSetBack);
  EXPECT_TRUE(application.attitude());
  EXPECT_EQ(application.command(Command::kSelectGyros, 0b11), Answer::kAccepted);
}

TEST(Clock, SetBackDegradesUntilAFixIsUsed) {
  for (const Mode mode : {kCalibrating, kNavigating}) {
    PairApplication application = application_in(mode);
    const double t_s = end_of(application);
    std::vector<GyroSample> samples = flight().samples;
    std::vector<StarFix> fixes = flight().fixes;
    for (GyroSample& sample : samples) {
      sample.t -= std::chrono::seconds(200);
    }
    for (StarFix& fix : fixes) {
      fix.t -= std::chrono::seconds(200);
    }
    fly_from(samples, kNoFixes, t_s - 200, t_s - 195, application);
    EXPECT_EQ(application.mode(), kDegraded);
    EXPECT_EQ(application.faults(), TRIHEDRON_FAULT_CLOCK_SET_BACK);
    fly_from(samples, fixes, t_s - 195, t_s - 180, application);
    EXPECT_EQ(application.mode(), mode);
    EXPECT_EQ(application.housekeeping().clock_set_backs, 1U);
    EXPECT_EQ(application.faults(), 0U);
  }
}

TEST(Clock, ThatStandsStillGivesNoAttitudeAndMovesNothing) {
  const PairApplication before = application_in(kCalibrating);
  PairApplication after = before;
  for (int i = 0; i < 100; ++i) {
    GyroSample sample = flight().samples[8 * 300 + static_cast<std::size_t>(i)];
    sample.t = flight().samples[8 * 300 - 1].t;
    EXPECT_EQ(after.on_gyro(sample).sample, SampleStatus::kRejectedOutOfOrder);
  }
  EXPECT_TRUE(after.has(Fault::kNoAttitude));
  EXPECT_EQ(after.mode(), kDegraded);
  EXPECT_EQ(after.on_board().navigation_attitude().value().C_in_c.raw(),
            before.on_board().navigation_attitude().value().C_in_c.raw());
  fly_from(flight(), 300, 310, after);
  EXPECT_EQ(after.mode(), kCalibrating);
}

TEST(Samples, FasterThanTheCapacityAreThinnedAndChangeNothing) {
  PairApplication all = application_in(kCalibrating);
  PairApplication some = all;
  for (std::size_t i = 8 * 300; i < 8 * 320; ++i) {
    some.on_gyro(flight().samples[i]);
    all.on_gyro(flight().samples[i]);
    for (const int ms : {1, 20, 74}) {
      GyroSample between = flight().samples[i];
      between.t += std::chrono::milliseconds(ms);
      between.h_b[1] = rotated<double>(between.h_b[1], Eigen::Vector3d::UnitX() * 1e-6 * ms);  // live
      between.h_b[0] = rotated<double>(between.h_b[0], Eigen::Vector3d::UnitY() * 1e-6 * ms);
      EXPECT_EQ(all.on_gyro(between).sample, SampleStatus::kThinned);
    }
  }
  Housekeeping thinned = all.housekeeping();
  EXPECT_EQ(thinned.samples_thinned, 480U);
  thinned.samples_thinned = 0;
  thinned.last_sample = some.housekeeping().last_sample;
  EXPECT_TRUE(same(thinned, some.housekeeping()));
}

TEST(Fixes, FasterThanTheyAreDealtWithAreRefusedAndNamed) {
  PairApplication application = application_in(kCalibrating);
  std::set<FixStatus> answers;
  for (int i = 0; i < 2000; ++i) {
    StarFix fix = flight().fixes[100];
    fix.t = application.on_board().t() + std::chrono::microseconds(100 * i);
    answers.insert(application.on_fix(fix).fix.status);
  }
  EXPECT_TRUE(answers.contains(FixStatus::kRejectedBacklog));
  fly_from(flight(), 300, 320, application);
  EXPECT_EQ(application.mode(), kCalibrating);
}

TEST(BrownOut, RestoredFromASnapshotItDegradesUntilAFixIsUsed) {
  using Store = SnapshotStore<PairApplication>;
  PairApplication application = application_in(kNavigating);
  const double t_s = end_of(application);
  std::vector<std::byte> memory(Store::kSize);
  EXPECT_NE(Store::save(application, memory), 0U);
  PairApplication again;
  ASSERT_TRUE(Store::restore(memory, again).ok());
  fly_from(flight().samples, kNoFixes, t_s + 40, t_s + 41, again);
  EXPECT_EQ(again.mode(), kDegraded);
  EXPECT_EQ(again.faults() & ~static_cast<std::uint32_t>(Fault::kStarTrackerLost), TRIHEDRON_FAULT_GAP);
  EXPECT_LT(error_rad(again), 60 * kArcsecond);  // drift over 40 s with a calibrated model
  fly_from(flight(), t_s + 41, t_s + 60, again);
  EXPECT_EQ(again.mode(), kNavigating);
  EXPECT_EQ(again.housekeeping().gaps, 1U);
}

TEST(Reset, BeginsAsAfterTheLoading) {
  PairApplication used = application_in(kNavigating);
  EXPECT_EQ(used.command(Command::kReset), Answer::kAccepted);
  EXPECT_EQ(used.mode(), kStandby);
  EXPECT_FALSE(used.attitude());
  EXPECT_EQ(used.faults(), 0U);
  EXPECT_EQ(used.command(Command::kStart), Answer::kAccepted);
  const auto fresh = test::started<PairApplication>(test::nominal_parameters());
  fly_from(flight(), 1300, 2000, used);
  fly_from(flight(), 1300, 2000, *fresh);
  EXPECT_EQ(used.attitude()->C_in_c.raw(), fresh->attitude()->C_in_c.raw());
  EXPECT_EQ(used.attitude()->covariance_rad2, fresh->attitude()->covariance_rad2);
  EXPECT_EQ(used.mode(), fresh->mode());
}

TEST(FilterRestarted, BeginsToAlignAgain) {
  // Momenta that were set by a wrong fix, contradicted by all others, again and again.
  std::vector<StarFix> fixes = flight().fixes;
  for (std::size_t i = 450; i < fixes.size(); ++i) {
    const Eigen::Vector3d axis = i / 60 % 2 == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
    fixes[i].q_in_c =
        fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(0.03 * static_cast<double>(i / 60 % 3), axis));
  }
  Parameters table = test::nominal_parameters();
  table.reopen_after_jump_rejections = 20;
  const auto application = test::started<PairApplication>(table);
  bool aligned_again = false;
  fly_from(flight().samples, fixes, 0, 1350, *application);
  EXPECT_EQ(application->mode(), kNavigating);
  fly_from(flight().samples, fixes, 1350, 3600, *application, [&](const StepReport& report) {
    aligned_again |= report.fix.status == FixStatus::kRestarted && application->mode() == kAligning;
  });
  EXPECT_GE(application->housekeeping().filter_restarts, 1U);
  EXPECT_TRUE(aligned_again);
}

TEST(FilterRestarted, AlsoWhereTheEstimateIsLost) {
  PairApplication application = application_in(kCalibrating);
  spoil_covariance(application);
  bool lost = false;
  fly_from(flight(), 300, 360, application, [&](const StepReport& report) {
    if (report.fix.status == FixStatus::kEstimateLost) {
      lost = true;
      EXPECT_EQ(application.mode(), kAligning);
    }
  });
  EXPECT_TRUE(lost);
  EXPECT_EQ(application.housekeeping().filter_restarts, 1U);
}

TEST(FilterRestarted, AlsoWhereTheEstimateIsLostWithoutAStarTracker) {
  PairApplication application = application_in(kCalibrating);
  fly_from(flight().samples, kNoFixes, 300, 350, application);
  spoil_covariance(application);
  bool lost = false;
  fly_from(flight().samples, kNoFixes, 350, 400, application, [&](const StepReport& report) {
    if (report.angles.status == FixStatus::kEstimateLost) {
      lost = true;
      EXPECT_EQ(application.mode(), kAligning);
    }
  });
  EXPECT_TRUE(lost);
  EXPECT_EQ(application.housekeeping().filter_restarts, 1U);
  fly_from(flight(), 400, 600, application);
  EXPECT_EQ(application.mode(), kCalibrating);
}

TEST(PairApplication, FitsInto32KiB) { EXPECT_LE(sizeof(PairApplication), 32U * 1024); }

// ---- The forecast

TEST(Forecast, OfAGyroOfAPairThatHasStuckIsThatItIsNotReady) {
  // The fix at 1500 s is the last before it, and is dealt with when it shows.
  PairApplication application = application_in(kNavigating);
  auto samples = frozen(1500, 1510);
  for (Eigen::Vector3d& h_b : samples[8 * 1498].h_b) {  // a spike, soon after which a stop is not known at once
    h_b = rotated<double>(h_b, 0.05 * h_b.unitOrthogonal());
  }
  fly_from(samples, flight().fixes, kAdopted_s, 1500, application);
  EXPECT_GT(application.forecast().ready_s(), 0);
  double ready_s = 1;
  fly_from(samples, flight().fixes, 1500, 1505, application, [&](const StepReport& report) {
    if (report.fix.t == Time(std::chrono::seconds(1500)) && report.fix.used()) {
      ready_s = application.forecast().ready_s();
    }
  });
  EXPECT_EQ(ready_s, 0);
  EXPECT_EQ(application.forecast().error_rad(), kInfinity);
  // Eight fixes later each attitude has been predicted for again.
  fly_from(samples, flight().fixes, 1505, 1550, application);
  EXPECT_GT(application.forecast().ready_s(), 0);
}

TEST(Error997, IsTheQuantileOfTheLength) {
  // Of one axis, of three equal ones, and of two: √χ² of 1, 3 and 2 degrees of freedom at 0.997, from tables.
  const auto of = [](double x, double y, double z) {
    return error_997_rad(Eigen::Vector3d(x, y, z).cwiseAbs2().asDiagonal());
  };
  // The cube root of χ² is normal within a percent there.
  EXPECT_NEAR(of(1e-4, 0, 0), 2.9677e-4, 0.03e-4);
  EXPECT_NEAR(of(1e-4, 1e-4, 0), 3.4086e-4, 0.03e-4);
  EXPECT_NEAR(of(1e-4, 1e-4, 1e-4), 3.7325e-4, 0.03e-4);
  EXPECT_EQ(of(0, 0, 0), 0);
  EXPECT_EQ(of(kNaN, 0, 0), kInfinity);
}

}  // namespace
}  // namespace trihedron
