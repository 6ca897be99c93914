// A bit flipped at a random place and time in the state of the application during a pass; what comes of it.
//
//   core_soft_errors [RUNS [SEED]]
//
// Each run takes up the pass at a random sample, flips one random bit between two samples, and flies on. The pass has a
// calibration that is adopted, and then twenty minutes without the star tracker. Without the guard a run is a process
// of its own, since it may crash; there are a fifth as many of them, and they fly on for two minutes. With the guard
// (guarded.hpp) the bit may be anywhere in state, copy and CRC; what it has repaired is the same bit for bit, so that
// six seconds are enough. Compared with the flight without a flip, sample by sample, an outcome is
//   harmless   the attitude stays within 10″ of it, its sigma within a factor of 1.5, and the verdict, which is mode
//   and faults, is the same detected   the application or the guard reports it crashed    the processor does: a wild
//   address, a failed assertion, or a loop without end, which a watchdog sees silent     neither: more than 10″ of
//   error, a mode that promises more, or sigmas too small by more than that.
// Ends with 0 if fewer than 0.1 % of the guarded runs were silent.

#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "application_flight.hpp"
#include "trihedron/core/guarded.hpp"

namespace trihedron {
namespace {

using GuardedApplication = Guarded<PairApplication>;

constexpr double kPass_s = 2800;
constexpr double kWithStarTracker_s = 1600;
constexpr double kFlownOn_s = 120;
constexpr double kSilent_rad = 10 * test::kArcsecond;
constexpr double kSigmaFactor = 1.5;
constexpr std::size_t kSamplesPerStep = 240;  // of the states kept
constexpr auto kSamplesFlownOn = static_cast<std::size_t>(kFlownOn_s * 8);
constexpr std::size_t kSamplesWithGuard = 48;

enum class Outcome : std::uint8_t { kHarmless, kDetected, kSilent, kCrashed };
constexpr std::size_t kOutcomes = 4;

/// What is compared at each sample.
struct Shown {
  Mode mode{};
  std::uint32_t faults = 0;
  bool has_attitude = false;
  Eigen::Matrix3d C_in_c = Eigen::Matrix3d::Identity();
  double sigma_rad = 0;
};
Shown shown_by(const PairApplication& application) {
  Shown shown{.mode = application.mode(), .faults = application.faults()};
  if (const auto solution = application.attitude()) {
    shown.has_attitude = true;
    shown.C_in_c = solution->C_in_c.raw();
    shown.sigma_rad = std::sqrt(solution->covariance_rad2.trace());
  }
  return shown;
}

/// The pass without a flip.
class Pass {
 public:
  Pass() {
    auto application = *test::started<PairApplication>(test::nominal_parameters());
    for (std::size_t i = 0; i < flight_.samples.size(); ++i) {
      if (i % kSamplesPerStep == 0) {
        states_.push_back(application);
      }
      feed(i, application);
      shown_.push_back(shown_by(application));
    }
  }

  [[nodiscard]] std::size_t samples() const { return flight_.samples.size(); }
  [[nodiscard]] const Shown& shown(std::size_t sample) const { return shown_[sample]; }
  /// Before this sample.
  [[nodiscard]] PairApplication state_at(std::size_t sample) const {
    PairApplication application = states_[sample / kSamplesPerStep];
    for (std::size_t i = sample / kSamplesPerStep * kSamplesPerStep; i < sample; ++i) {
      feed(i, application);
    }
    return application;
  }
  /// A sample, and the fix at its time: one every three seconds.
  void feed(std::size_t sample, PairApplication& application) const {
    application.on_gyro(flight_.samples[sample]);
    if (sample % 24 == 0 && static_cast<double>(sample) < 8 * kWithStarTracker_s) {
      application.on_fix(flight_.fixes[sample / 24]);
    }
  }

 private:
  test::Flight flight_{{.duration_s = kPass_s}};
  std::vector<PairApplication> states_;
  std::vector<Shown> shown_;
};

/// Of one sample: 0 as without the flip, 1 reported, 2 wrong.
int compare(const Shown& its, const Shown& expected) {
  if (its.mode != expected.mode || its.faults != expected.faults || its.has_attitude != expected.has_attitude) {
    // A fault, a mode that promises less, or no attitude tells that something is wrong; a better one is a wrong
    // verdict.
    const bool promises_more = its.mode == Mode::kNavigating && expected.mode != Mode::kNavigating;
    return promises_more ? 2 : 1;
  }
  const double off_rad = test::rotation_vector(expected.C_in_c.transpose() * its.C_in_c).norm();
  const bool is_right = off_rad <= kSilent_rad && its.sigma_rad >= expected.sigma_rad / kSigmaFactor;
  return its.has_attitude && !is_right ? 2 : 0;
}

template <class T>
void flip(T& object, std::size_t bit) {
  std::as_writable_bytes(std::span(&object, 1))[bit / 8] ^= std::byte(1U << bit % 8);
}

Outcome outcome_unguarded(const Pass& pass, std::size_t sample, std::size_t bit) {
  PairApplication application = pass.state_at(sample);
  flip(application, bit);
  for (std::size_t i = sample; i < sample + kSamplesFlownOn; ++i) {
    pass.feed(i, application);
    const int found = compare(shown_by(application), pass.shown(i));
    if (found != 0) {
      return found == 1 ? Outcome::kDetected : Outcome::kSilent;
    }
  }
  return Outcome::kHarmless;
}

/// In a process of its own, for at most two seconds.
Outcome outcome_in_child(const Pass& pass, std::size_t sample, std::size_t bit) {
  const pid_t child = fork();
  if (child == 0) {
    std::freopen("/dev/null", "w", stderr);
    alarm(2);
    _exit(static_cast<int>(outcome_unguarded(pass, sample, bit)));
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) < static_cast<int>(kOutcomes)
             ? Outcome{static_cast<std::uint8_t>(WEXITSTATUS(status))}
             : Outcome::kCrashed;
}

Outcome outcome_guarded(const Pass& pass, std::size_t sample, std::size_t bit) {
  const auto guarded = std::make_unique<GuardedApplication>(pass.state_at(sample));
  flip(*guarded, bit);
  bool reported = false;
  for (std::size_t i = sample; i < sample + kSamplesWithGuard; ++i) {
    const GuardFinding found = guarded->use([&](PairApplication& application) { pass.feed(i, application); });
    reported = reported || found != GuardFinding::kWhole;
    if (found == GuardFinding::kLost) {
      return Outcome::kDetected;
    }
    if (compare(shown_by(guarded->state()), pass.shown(i)) != 0) {
      return reported ? Outcome::kDetected : Outcome::kSilent;
    }
  }
  return reported ? Outcome::kDetected : Outcome::kHarmless;
}

template <class Run>
std::array<int, kOutcomes> campaign(const char* name, const Pass& pass, int runs, unsigned seed, std::size_t bits,
                                    const Run& run) {
  std::mt19937_64 random(seed);
  // Raw numbers and a remainder: the distributions of the standard library differ between libraries.
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  std::array<int, kOutcomes> counts{};
  for (int i = 0; i < runs; ++i) {
    const std::size_t sample = below(pass.samples() - kSamplesFlownOn);
    const std::size_t bit = below(bits);
    ++counts[static_cast<std::size_t>(run(pass, sample, bit))];
  }
  const auto share = [&](Outcome outcome) { return 100.0 * counts[static_cast<std::size_t>(outcome)] / runs; };
  std::printf("%-14s %6d runs, seed %u: harmless %6.2f %%, detected %6.2f %%, crashed %5.2f %%, silent %5.2f %%\n",
              name, runs, seed, share(Outcome::kHarmless), share(Outcome::kDetected), share(Outcome::kCrashed),
              share(Outcome::kSilent));
  std::fflush(stdout);
  return counts;
}

int main_of(int runs, unsigned seed) {
  const Pass pass;
  campaign("without guard", pass, (runs + 4) / 5, seed, 8 * sizeof(PairApplication), outcome_in_child);
  const auto guarded = campaign("with guard", pass, runs, seed, 8 * sizeof(GuardedApplication), outcome_guarded);
  return 1000 * guarded[static_cast<std::size_t>(Outcome::kSilent)] < runs ? 0 : 1;
}

}  // namespace
}  // namespace trihedron

int main(int count, char** arguments) {
  const int runs = count > 1 ? std::atoi(arguments[1]) : 10000;
  const int seed = count > 2 ? std::atoi(arguments[2]) : 1;
  if (runs <= 0 || seed < 0) {
    std::fprintf(stderr, "core_soft_errors [RUNS [SEED]]\n");
    return 2;
  }
  return trihedron::main_of(runs, static_cast<unsigned>(seed));
}
