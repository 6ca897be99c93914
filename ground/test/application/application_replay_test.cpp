#include "trihedron/ground/application/application_replay.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "passes.hpp"
#include "trihedron.h"
#include "trihedron/core/snapshot.hpp"
#include "trihedron/ground/application/parameters.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/onboard/events.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::hours;
using std::chrono::minutes;

/// An attitude as it was delivered, all its bits.
struct Delivered {
  Time t{};
  std::array<double, 4> q{};
  std::array<double, 3> sigma_rad{};

  friend bool operator==(const Delivered&, const Delivered&) = default;
};

Delivered delivered(Time t, const Eigen::Quaterniond& q, const Eigen::Vector3d& sigma_rad) {
  return {t, {q.x(), q.y(), q.z(), q.w()}, {sigma_rad.x(), sigma_rad.y(), sigma_rad.z()}};
}

/// A quarter of an orbit is predicted for twenty minutes, so that two hours show an adoption.
Required soon() { return {300 * 4.84813681109536e-6, minutes(20), minutes(20)}; }

CalibrationOptions at_each_fix() {
  CalibrationOptions options = told();
  options.corrections.when = CorrectionOptions::When::kEachFix;
  return options;
}

Parameters table_of(const Pass& pass) { return parameters_of(pass.settings, at_each_fix(), soon()); }

struct Flown {
  std::vector<Delivered> attitude;
  std::optional<Time> adopted;  ///< when the navigator first used the calibration
  Housekeeping record{};
  Calibration calibration;
};

void fly(ApplicationReplay& replay, Flown& flown) {
  while (replay.next_t()) {
    const ApplicationReplay::Step& step = replay.feed();
    if (step.attitude) {
      flown.attitude.push_back(delivered(step.report.t, step.attitude->C_in_c.quaternion(),
                                         step.attitude->covariance_rad2.diagonal().cwiseSqrt()));
    }
    if (!flown.adopted && step.report.fix.used() && replay.housekeeping().adopted != 0) {
      flown.adopted = step.report.t;
    }
  }
  flown.record = replay.housekeeping();
  flown.calibration = replay.calibration().value();
}

const Flown& whole() {
  static const Flown its = [] {
    ApplicationReplay replay(two_hours().pass, table_of(two_hours().pass));
    Flown flown;
    fly(replay, flown);
    return flown;
  }();
  return its;
}

std::vector<Delivered> navigated(const Pass& pass, bool online) {
  CalibrationOptions options = at_each_fix();
  options.corrections.take_parameters = online;
  const NavigationRun run = navigate(pass, options, {});
  std::vector<Delivered> attitude;
  for (std::size_t i = 0; i < run.attitude.size(); ++i) {
    attitude.push_back(delivered(run.attitude.t[i], run.attitude.q_in_c[i], run.attitude.sigma_rad[i]));
  }
  return attitude;
}

double angle_rad(const Delivered& a, const Delivered& b) {
  const Eigen::Quaterniond qa(a.q[3], a.q[0], a.q[1], a.q[2]);
  const Eigen::Quaterniond qb(b.q[3], b.q[0], b.q[1], b.q[2]);
  return qa.angularDistance(qb);
}

TEST(ApplicationReplay, IsNavigateWithThePriorUntilTheAdoptionAndOnlineFromThenOn) {
  const Flown& flown = whole();
  ASSERT_TRUE(flown.adopted.has_value());
  EXPECT_EQ(flown.record.adoptions, 1U);
  EXPECT_EQ(flown.record.withdrawals, 0U);
  const std::vector<Delivered> prior = navigated(two_hours().pass, false);
  const std::vector<Delivered> online = navigated(two_hours().pass, true);
  ASSERT_EQ(flown.attitude.size(), prior.size());
  ASSERT_EQ(flown.attitude.size(), online.size());
  std::size_t before = 0;
  std::size_t differ = 0;
  for (std::size_t i = 0; i < flown.attitude.size(); ++i) {
    const bool is_before = flown.attitude[i].t < *flown.adopted;
    before += is_before ? 1U : 0U;
    const std::vector<Delivered>& other = is_before ? prior : online;
    ASSERT_EQ(flown.attitude[i].t, other[i].t);
    ASSERT_LT(angle_rad(flown.attitude[i], other[i]), 1e-12) << i;
    differ += flown.attitude[i] == other[i] ? 0U : 1U;
  }
  RecordProperty("rows_before_adoption", static_cast<int>(before));
  EXPECT_EQ(differ, 0U);
  EXPECT_GT(before, 1000U);
  EXPECT_GT(flown.attitude.size() - before, 1000U);
}

TEST(ApplicationReplay, IsWhatTheInterfaceInCGives) {
  const Pass& pass = two_hours().pass;
  const Parameters parameters = table_of(pass);
  alignas(TRIHEDRON_ALIGNMENT) static std::array<std::byte, TRIHEDRON_SIZE_OF_2_GYROS> memory;
  trihedron_application* its = trihedron_create(memory.data(), memory.size(), 2);
  ASSERT_NE(its, nullptr);
  ASSERT_EQ(trihedron_load_parameters(its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
  ASSERT_EQ(trihedron_command(its, TRIHEDRON_COMMAND_START, 0), TRIHEDRON_ANSWER_ACCEPTED);
  Events events(pass, 1);
  std::vector<Delivered> attitude;
  while (const auto event = events.next()) {
    if (const auto* fix = std::get_if<StarFix>(&*event)) {
      trihedron_star_fix record{fix->t.time_since_epoch().count(), {}};
      Eigen::Map<Eigen::Vector4d>(record.q_in_c) = fix->q_in_c.coeffs();
      trihedron_on_fix(its, &record);
      continue;
    }
    const auto& sample = std::get<GyroSample>(*event);
    trihedron_gyro_sample record{sample.t.time_since_epoch().count(), {}};
    for (int k = 0; k < 2; ++k) {
      Eigen::Map<Eigen::Vector3d>(record.h_b[k]) = sample.h_b[k];
    }
    struct trihedron_attitude given {};
    if (trihedron_on_gyro(its, &record) == TRIHEDRON_SAMPLE_USED && trihedron_get_attitude(its, &given) == 1) {
      attitude.push_back(delivered(Time(Duration(given.time_ns)), Eigen::Quaterniond(given.q_in_c),
                                   {std::sqrt(given.covariance_rad2[0][0]), std::sqrt(given.covariance_rad2[1][1]),
                                    std::sqrt(given.covariance_rad2[2][2])}));
    }
  }
  EXPECT_TRUE(attitude == whole().attitude);
}

bool same_calibration(const Calibration& a, const Calibration& b) {
  bool same = a.t == b.t && a.covariance == b.covariance && a.statistics.nis_mean == b.statistics.nis_mean &&
              a.statistics.innovation_rms_rad == b.statistics.innovation_rms_rad &&
              a.statistics.fixes_used == b.statistics.fixes_used;
  for (std::size_t k = 0; k < a.gyros.size(); ++k) {
    same = same && a.gyros[k].drift_rad_s == b.gyros[k].drift_rad_s &&
           a.gyros[k].momentum_in == b.gyros[k].momentum_in &&
           a.gyros[k].alignment_rotation_vector_rad == b.gyros[k].alignment_rotation_vector_rad;
  }
  return same;
}

TEST(ApplicationReplay, GoesOnBitForBitFromASnapshotTakenAnywhere) {
  const Pass& pass = two_hours().pass;
  std::mt19937_64 random(7);
  for (int attempt = 0; attempt < 4; ++attempt) {
    auto broken_off = std::make_unique<ApplicationReplay>(pass, table_of(pass));
    std::vector<std::byte> memory(broken_off->snapshots_size());
    Flown flown;
    std::uniform_int_distribution<int> events(1, 40000);
    for (int left = events(random); left > 0; --left) {
      const ApplicationReplay::Step& step = broken_off->feed();
      if (step.attitude) {
        flown.attitude.push_back(delivered(step.report.t, step.attitude->C_in_c.quaternion(),
                                           step.attitude->covariance_rad2.diagonal().cwiseSqrt()));
      }
    }
    EXPECT_EQ(broken_off->save(memory, {3, 4, 1}).sequence, 1U);
    EXPECT_EQ(broken_off->attitudes(), flown.attitude.size());
    broken_off.reset();
    ApplicationReplay replay(pass, table_of(pass));
    const ApplicationReplay::Resumed resumed = replay.resume(memory);
    ASSERT_TRUE(resumed.is_of_this_replay);
    EXPECT_EQ(resumed.output.bytes, 3U);
    EXPECT_EQ(resumed.output.crc, 4U);
    fly(replay, flown);
    EXPECT_TRUE(flown.attitude == whole().attitude);
    EXPECT_EQ(replay.attitudes(), whole().attitude.size());
    EXPECT_TRUE(same_calibration(flown.calibration, whole().calibration));
    EXPECT_EQ(std::memcmp(&flown.record, &whole().record, sizeof flown.record), 0);
  }
}

TEST(ApplicationReplay, WritesItsSnapshotsToTheSlotsInTurn) {
  const Pass& pass = two_hours().pass;
  ApplicationReplay replay(pass, table_of(pass));
  std::vector<std::byte> memory(replay.snapshots_size());
  for (std::uint64_t sequence = 1; sequence < 6; ++sequence) {
    const std::vector<std::byte> before = memory;
    const ApplicationReplay::Saved saved = replay.save(memory, {});
    EXPECT_EQ(saved.sequence, sequence);
    EXPECT_EQ(saved.size, memory.size() / 2);
    EXPECT_EQ(saved.offset, sequence % 2 == 1 ? 0 : memory.size() / 2);
    const std::size_t other = memory.size() / 2 - saved.offset;
    EXPECT_EQ(std::memcmp(&before[other], &memory[other], saved.size), 0);
    static_cast<void>(replay.feed());
  }
}

TEST(ApplicationReplay, RefusesSnapshotsThatAreTornOrOfAnotherReplay) {
  const Pass& pass = two_hours().pass;
  ApplicationReplay replay(pass, table_of(pass));
  std::vector<std::byte> memory(replay.snapshots_size());
  static_cast<void>(replay.feed());
  static_cast<void>(replay.save(memory, {}));
  std::vector<std::byte> torn = memory;
  torn[1000] ^= std::byte{1};
  const ApplicationReplay::Resumed of_torn = replay.resume(torn);
  EXPECT_EQ(of_torn.sequence, 0U);
  EXPECT_EQ(of_torn.slots[0], SnapshotAnswer::kCorrupted);
  EXPECT_EQ(of_torn.slots[1], SnapshotAnswer::kForeign);
  EXPECT_EQ(replay.resume(std::span(memory).first(100)).sequence, 0U);

  Pass other = pass;
  other.gyro.h[12345] += 1e-15;
  ApplicationReplay of_other(other, table_of(other));
  EXPECT_FALSE(of_other.resume(memory).is_of_this_replay);
  EXPECT_EQ(of_other.next_t(), std::min(other.gyro.t[0], other.star_tracker.t[0]));
  Parameters stricter = table_of(pass);
  stricter.gate_nis += 1;
  EXPECT_FALSE(ApplicationReplay(pass, stricter).resume(memory).is_of_this_replay);
  EXPECT_TRUE(ApplicationReplay(pass, table_of(pass)).resume(memory).is_of_this_replay);
}

/// A snapshot in which one number of 64 bits of the first slot is another, with a CRC that is right all the same.
std::vector<std::byte> forged(std::vector<std::byte> memory, std::size_t at, std::uint64_t number) {
  SnapshotHeader header;
  std::memcpy(&header, memory.data(), sizeof header);
  std::memcpy(&memory[at], &number, sizeof number);
  const std::vector<std::byte> before = memory;
  const std::size_t size = memory.size() / 2;
  trihedron::detail::write_slot(std::span(memory).first(size), header.layout, header.sequence,
                                std::span(before).first(size).subspan(sizeof header));
  return memory;
}

TEST(ApplicationReplay, RefusesASnapshotOfAPlaceThatThePassDoesNotHave) {
  const Pass& pass = two_hours().pass;
  ApplicationReplay replay(pass, table_of(pass));
  std::vector<std::byte> memory(replay.snapshots_size());
  for (int i = 0; i < 5000; ++i) {
    static_cast<void>(replay.feed());
  }
  const std::uint64_t attitudes = replay.attitudes();
  static_cast<void>(replay.save(memory, {}));
  // The mark of the replay, the samples taken, the fixes of four star trackers, and the attitudes that came of them.
  std::size_t mark = memory.size() / 2 - 8;
  const auto number_at = [&](std::size_t at) {
    std::uint64_t number = 0;
    std::memcpy(&number, &memory[at], sizeof number);
    return number;
  };
  while (number_at(mark) >> 32 != pass.gyro.size() + pass.star_tracker.size()) {
    mark -= 8;
  }
  const std::uint64_t samples = number_at(mark + 8);
  ASSERT_EQ(samples + number_at(mark + 16), 5000U);
  ASSERT_EQ(number_at(mark + 48), attitudes);
  const auto is_taken = [&](std::size_t at, std::uint64_t number) {
    ApplicationReplay other(pass, table_of(pass));
    const bool taken = other.resume(forged(memory, at, number)).is_of_this_replay;
    EXPECT_EQ(other.attitudes(), taken ? number_at(mark + 48) : 0);
    return taken;
  };
  EXPECT_TRUE(is_taken(mark + 8, samples));
  EXPECT_FALSE(is_taken(mark, number_at(mark) + 1));
  EXPECT_TRUE(is_taken(mark + 8, pass.gyro.size()));
  EXPECT_FALSE(is_taken(mark + 8, pass.gyro.size() + 1));
  EXPECT_FALSE(is_taken(mark + 8, attitudes - 1));  // fewer samples than attitudes
  EXPECT_FALSE(is_taken(mark + 16, pass.star_tracker.size() + 1));
  EXPECT_FALSE(is_taken(mark + 24, 1));  // of a star tracker that the application does not have
  EXPECT_FALSE(is_taken(mark + 40, ~std::uint64_t{0}));
}

TEST(ApplicationReplay, TakesThreeGyros) {
  Scenario scenario = scenario_in_eq1(5, minutes(10));
  scenario.gyros.resize(3, scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = {0.1, 0.2, 1};
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  ApplicationReplay replay(simulated.pass, table_of(simulated.pass));
  Flown flown;
  fly(replay, flown);
  EXPECT_EQ(replay.mode(), Mode::kCalibrating);
  EXPECT_EQ(flown.calibration.gyros.size(), 3U);
  EXPECT_GT(flown.attitude.size(), 4000U);
  EXPECT_TRUE(flown.calibration.verdict.has(FindingCode::kNotAdopted));
}

TEST(ApplicationReplay, OfAnApplicationThatTakesEverythingHasNothingNotTaken) {
  ApplicationReplay replay(two_hours().pass, table_of(two_hours().pass));
  Flown flown;
  fly(replay, flown);
  EXPECT_TRUE(replay.verdict().trustworthy);
  EXPECT_TRUE(replay.verdict().findings.empty());
  EXPECT_EQ(replay.not_taken().samples, 0U);
  EXPECT_EQ(replay.not_taken().fixes,
            two_hours().pass.star_tracker.size() - flown.record.fixes_used - flown.record.fixes_rejected);
  EXPECT_LE(replay.not_taken().fixes, 1U);  // the last one waits for samples
}

TEST(ApplicationReplay, OfAnApplicationThatHasFailedIsNotTrustworthyAndSaysWhenAndWhy) {
  Pass pass = two_hours().pass;
  const std::size_t lost = pass.gyro.size() - pass.gyro.size() / 24;  // for five minutes, after the adoption
  for (std::size_t i = lost; i < pass.gyro.size(); ++i) {
    std::copy_n(pass.gyro.h.begin() + static_cast<std::ptrdiff_t>(6 * lost + 3), 3,
                pass.gyro.h.begin() + static_cast<std::ptrdiff_t>(6 * i + 3));
  }
  ApplicationReplay replay(pass, table_of(pass));
  std::optional<Time> failed;
  while (replay.next_t()) {
    const ApplicationReplay::Step& step = replay.feed();
    if (!failed && replay.mode() == Mode::kFailed) {
      failed = step.report.t;
    }
  }
  ASSERT_TRUE(failed.has_value());
  const Housekeeping record = replay.housekeeping();
  EXPECT_EQ(record.adopted, 1);
  const Verdict verdict = replay.verdict();
  EXPECT_FALSE(verdict.trustworthy);
  ASSERT_EQ(verdict.findings.size(), 1U);
  const Finding& finding = verdict.findings[0];
  EXPECT_EQ(finding.code, FindingCode::kApplicationFailed);
  EXPECT_EQ(finding.severity, FindingSeverity::kDoNotUse);
  EXPECT_THAT(finding.text,
              testing::HasSubstr(fmt::format("failed at {:.1f} min", to_seconds(*failed - pass.settings.epoch) / 60)));
  EXPECT_THAT(finding.evidence, testing::StartsWith("gyro 2 stuck; the last sample "));
  // All after that time, a minute and a little after the loss; fixes that waited then as well.
  const auto after = [&](const std::vector<Time>& t) {
    return static_cast<std::uint64_t>(t.end() - std::ranges::upper_bound(t, *failed));
  };
  EXPECT_NEAR(to_seconds(*failed - pass.gyro.t[lost]), 60, 3);
  EXPECT_EQ(replay.not_taken().samples, after(pass.gyro.t));
  EXPECT_GE(replay.not_taken().fixes, after(pass.star_tracker.t));
  EXPECT_LE(replay.not_taken().fixes, after(pass.star_tracker.t) + 2);
  ASSERT_TRUE(replay.calibration().has_value());
  EXPECT_FALSE(replay.calibration()->verdict.trustworthy);
  EXPECT_TRUE(replay.calibration()->verdict.has(FindingCode::kApplicationFailed));
}

TEST(ApplicationReplay, ThatHasFailedAfterASnapshotSaysTheSame) {
  Pass pass = two_hours().pass;
  std::fill(pass.gyro.h.begin() + 6000, pass.gyro.h.end(), 0.0);  // no readings after two minutes
  ApplicationReplay whole_replay(pass, table_of(pass));
  std::vector<std::byte> memory(whole_replay.snapshots_size());
  for (int fed = 0; whole_replay.next_t(); ++fed) {
    if (fed == 10000) {
      ASSERT_EQ(whole_replay.mode(), Mode::kFailed);
      static_cast<void>(whole_replay.save(memory, {}));
    }
    static_cast<void>(whole_replay.feed());
  }
  ApplicationReplay replay(pass, table_of(pass));
  ASSERT_TRUE(replay.resume(memory).is_of_this_replay);
  while (replay.next_t()) {
    static_cast<void>(replay.feed());
  }
  const Verdict verdict = replay.verdict();
  ASSERT_EQ(verdict.findings.size(), 1U);  // it does not navigate, with this calibration or without
  EXPECT_EQ(verdict.findings[0].code, FindingCode::kApplicationFailed);
  EXPECT_EQ(verdict.findings[0].text, whole_replay.verdict().findings.at(0).text);
  EXPECT_EQ(verdict.findings[0].evidence, whole_replay.verdict().findings.at(0).evidence);
  EXPECT_GT(replay.not_taken().samples, 50000U);
  EXPECT_EQ(replay.not_taken().samples, whole_replay.not_taken().samples);
  EXPECT_EQ(replay.not_taken().fixes, whole_replay.not_taken().fixes);
}

TEST(ParametersOfAPass, RefuseWhatTheTableHasNoRoomFor) {
  const PassSettings& settings = two_hours().pass.settings;
  const auto expect_refused = [&](const std::function<void(CalibrationOptions&, PassSettings&)>& change) {
    CalibrationOptions options;
    PassSettings changed = settings;
    change(options, changed);
    EXPECT_THROW(static_cast<void>(parameters_of(changed, options, Required::usual())), SetupError);
  };
  EXPECT_NO_THROW(static_cast<void>(parameters_of(settings, {}, Required::usual())));
  expect_refused([](auto& options, auto&) { options.drift_model = kEsg20; });
  expect_refused([](auto& options, auto&) { options.estimator = Estimator::kPaper; });
  expect_refused([](auto& options, auto&) { options.student_t_freedom = 8; });
  expect_refused([](auto& options, auto&) {
    options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kOn;
  });
  expect_refused([](auto&, auto& changed) { changed.gyros.resize(4, changed.gyros[0]); });
  expect_refused([](auto&, auto& changed) { changed.gyros.resize(1); });
}

TEST(ParametersOfAPass, AreRefusedByTheApplicationWithAReason) {
  const Pass& pass = two_hours().pass;
  Parameters parameters = table_of(pass);
  parameters.covariance[0] = -1;
  EXPECT_THROW(ApplicationReplay(pass, parameters), SetupError);
  parameters = table_of(pass);
  parameters.window_ns = 0;
  EXPECT_THROW(ApplicationReplay(pass, parameters), SetupError);
}

}  // namespace
}  // namespace trihedron::ground
