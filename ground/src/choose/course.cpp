#include "choose/course.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "choose/by_pass.hpp"
#include "choose/noise_search.hpp"
#include "choose/orbital_drift.hpp"
#include "choose/polhodes.hpp"
#include "choose/vertex.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// A course by which the coefficients are found to change.
struct FoundCourse {
  CourseOfChange::Kind kind;
  double time_s;           ///< an even change has none
  double least_s, most_s;  ///< between which the time is
};

/// Of what moves most likely, where it is a change of the coefficients that has a course.
std::optional<FoundCourse> course_of(const std::vector<Change>& changes, Time epoch) {
  if (changes.empty() || !changes.front().is_found() || changes.front().moving != Moving::kCoefficients) {
    return std::nullopt;
  }
  const Change& change = changes.front();
  if (change.motion == Motion::kDecay) {
    const double decay_s = to_seconds(change.decay);
    return FoundCourse{CourseOfChange::Kind::kWarmUp, decay_s, decay_s / 2, decay_s * 2};
  }
  if (change.motion == Motion::kStep) {
    const double from_s = to_seconds(change.from - epoch);
    const double until_s = to_seconds(change.until - epoch);
    return FoundCourse{CourseOfChange::Kind::kJump, (from_s + until_s) / 2, from_s, until_s};
  }
  if (change.motion == Motion::kRamp) {
    return FoundCourse{CourseOfChange::Kind::kEven, 0, 0, 0};
  }
  return std::nullopt;
}

void use_course(CourseOfChange::Kind kind, double time_s, CalibrationOptions& options) {
  options.further_states[FurtherState::kCoefficientChange] = Choice::kOn;
  options.further_states.change_course = kind;
  if (kind != CourseOfChange::Kind::kEven) {
    options.further_states.change_time = from_seconds(time_s);
  }
}

/// The time of a course that makes the pass most likely, with the random walk that is then likeliest.
struct LikelyCourse {
  double time_s;
  double sigma_s;  ///< of the time; before it is known, how far it may be from the likeliest
  double walk_rad_sqrt_s;
};

/// Looks for it with these options but for the noise, from a first one on: again and again the vertex of a parabola
/// through three times a sigma apart. What noise was found without the course stands for a part of it, and goes as the
/// time is told better. A random walk is enough for that.
LikelyCourse most_likely_course(const Pass& pass, const Screened& screened, CalibrationOptions options,
                                const FoundCourse& course, LikelyCourse likely) {
  constexpr int kMostRounds = 12;
  constexpr double kEnough = 0.005;  // ln, a tenth of a sigma of the time, whose uncertainty is in no other sigma
  constexpr double kAtOnce = 4;      // times as large a step where the vertex is far, as small where it is no better
  const double least_walk = options.direction_random_walk_rad_sqrt_s;
  options.direction_random_walk_rad_sqrt_s = likely.walk_rad_sqrt_s;
  options.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  std::optional<Trial> last;
  const auto fit = [&](double at_s) {
    use_course(course.kind, at_s, options);
    if (last) {
      last->release();
    }
    Trial trial(pass, screened, options, {}, last ? &*last : nullptr);
    last.emplace(std::move(trial));
    return last->log_likelihood();
  };
  const auto within = [&](double at_s) { return std::clamp(at_s, course.least_s, course.most_s); };
  fit(likely.time_s);
  for (int round = 0; round < kMostRounds; ++round) {
    const double walk_before = likely.walk_rad_sqrt_s;
    options.direction_random_walk_rad_sqrt_s = least_walk;
    const NoiseFit walk =
        round == 0 ? with_most_likely_walk(*last, options) : with_most_likely_walk_near(*last, options);
    use_walk(walk.noise, options);
    likely.walk_rad_sqrt_s = options.direction_random_walk_rad_sqrt_s;
    const bool other_noise = std::abs(likely.walk_rad_sqrt_s - walk_before) > kNoiseTolerance * walk_before;
    const double step_s = likely.sigma_s;
    const double here = last->log_likelihood();
    const double before = fit(within(likely.time_s - step_s));
    const double after = fit(within(likely.time_s + step_s));
    const double bend = 2 * here - before - after;  // one, of a step of a sigma
    const double by = towards_vertex(before, here, after);
    const double vertex_s = within(likely.time_s + by * step_s);
    const bool is_better = fit(vertex_s) > here;
    if (is_better) {
      likely.time_s = vertex_s;
      likely.sigma_s *= bend > 0 ? std::clamp(1 / std::sqrt(bend), 1 / kAtOnce, kAtOnce) : kAtOnce;
    } else {
      likely.sigma_s /= kAtOnce;
      fit(likely.time_s);
    }
    const double expected_gain = by * ((after - before) - by * bend) / 2;
    if (expected_gain < kEnough && !other_noise) {
      break;
    }
  }
  return likely;
}

/// The same from what moves on. By eq. (1) alone it takes a fraction of the work, so that a field has only the rest of
/// the way to go.
double most_likely_time_s(const Pass& pass, const Screened& screened, const CalibrationOptions& options,
                          const FoundCourse& course) {
  LikelyCourse likely{course.time_s, (course.most_s - course.least_s) / 4, options.direction_random_walk_rad_sqrt_s};
  if (options.drift_field) {
    CalibrationOptions by_eq1 = options;
    by_eq1.drift_field = false;
    by_eq1.drift_model = kEsg7;
    likely = most_likely_course(pass, screened, by_eq1, course, likely);
  }
  return most_likely_course(pass, screened, options, course, likely).time_s;
}

}  // namespace

Decision decide_with_course(const Pass& pass, const Screened& screened, CalibrationOptions asked,
                            const DriftModelId& largest_model, bool change_is_open, const Progress& progress) {
  Decision decision = decide_on_polhodes(pass, screened, asked, largest_model, progress);
  const bool has_polhodes = decision.options.further_states.is_on(FurtherState::kPolhode);
  const std::optional<FoundCourse> course =
      change_is_open && !has_polhodes ? course_of(decision.changes, pass.settings.epoch) : std::nullopt;
  if (!course) {
    return decision;
  }
  begin_stage(progress, "looks for the time of a change");
  CalibrationOptions with = asked;
  const bool is_even = course->kind == CourseOfChange::Kind::kEven;
  use_course(course->kind, is_even ? 0 : most_likely_time_s(pass, screened, decision.options, *course), with);
  Decision changing = decide_by_pass(pass, screened, with, largest_model, progress);
  const double gain = changing.log_likelihood - decision.log_likelihood;
  if (gain <= kLogOddsToAccept) {
    return decision;
  }
  keep_what_comes_back(decision, changing);
  changing.evidence.push_back({FurtherState::kCoefficientChange, gain, true});
  return changing;
}

}  // namespace trihedron::ground
