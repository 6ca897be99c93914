#include "trihedron/ground/application/application_replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <variant>

#include "onboard/calibration_of.hpp"
#include "trihedron/core/application.hpp"
#include "trihedron/core/crc32.hpp"
#include "trihedron/core/snapshot.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/onboard/events.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/records/status.hpp"

namespace trihedron::ground {
namespace detail {

/// A replay of either application.
class FlownApplication {
 public:
  using Step = ApplicationReplay::Step;
  using Saved = ApplicationReplay::Saved;
  using Resumed = ApplicationReplay::Resumed;

  FlownApplication() = default;
  FlownApplication(const FlownApplication&) = delete;
  FlownApplication& operator=(const FlownApplication&) = delete;
  virtual ~FlownApplication() = default;

  [[nodiscard]] virtual std::optional<Time> next_t() const = 0;
  virtual const Step& feed() = 0;
  [[nodiscard]] virtual Mode mode() const = 0;
  [[nodiscard]] virtual Housekeeping housekeeping() const = 0;
  [[nodiscard]] virtual std::optional<Calibration> calibration() const = 0;
  [[nodiscard]] virtual Verdict verdict() const = 0;
  [[nodiscard]] virtual NotTaken not_taken() const = 0;
  [[nodiscard]] virtual std::uint64_t attitudes() const = 0;
  [[nodiscard]] virtual std::size_t snapshots_size() const = 0;
  virtual Saved save(std::span<std::byte> memory, const ConfirmedOutput& output) = 0;
  virtual Resumed resume(std::span<const std::byte> memory) = 0;
};

}  // namespace detail

namespace {

/// Of the ground's part of a state; to be counted up whenever it changes.
constexpr std::uint32_t kGroundPartVersion = 2;

/// What the ground keeps beside the application; plain data.
struct GroundPart {
  std::uint64_t replay = 0;  ///< mark of pass and parameters
  Events::Position position;
  std::uint64_t attitudes = 0;
  ConfirmedOutput output;
  FixSums fixes;
};

template <class Application>
struct State {
  // The application's own number has its version above, and the size of a pointer below.
  static constexpr std::uint32_t kSnapshotLayout = Application::kSnapshotLayout ^ (kGroundPartVersion << 28);

  Application application;
  GroundPart ground;
};

/// A State in memory that was zero before: gaps between its members are part of a snapshot too.
template <class State>
class ZeroedState {
 public:
  ZeroedState() : memory_(static_cast<std::byte*>(::operator new(sizeof(State), std::align_val_t(alignof(State))))) {
    std::fill_n(memory_.get(), sizeof(State), std::byte{});
    state_ = ::new (memory_.get()) State;
  }
  [[nodiscard]] State& operator*() { return *state_; }
  [[nodiscard]] const State& operator*() const { return *state_; }
  [[nodiscard]] State* operator->() { return state_; }
  [[nodiscard]] const State* operator->() const { return state_; }

 private:
  struct Free {
    void operator()(std::byte* memory) const { ::operator delete(memory, std::align_val_t(alignof(State))); }
  };

  std::unique_ptr<std::byte, Free> memory_;
  State* state_ = nullptr;
};

std::uint32_t crc_of(const auto& values, std::uint32_t before) {
  return crc32(std::as_bytes(std::span(values)), before);
}

/// Tells pass and parameters from others.
std::uint64_t mark_of(const Pass& pass, const Parameters& parameters) {
  std::uint32_t crc = crc_of(std::span(&parameters, 1), 0);
  crc = crc_of(std::span(&pass.settings.epoch, 1), crc);
  crc = crc_of(pass.gyro.t, crc);
  crc = crc_of(pass.gyro.h, crc);
  crc = crc_of(pass.star_tracker.t, crc);
  for (const Eigen::Quaterniond& q : pass.star_tracker.q_in_c) {
    crc = crc32(std::as_bytes(std::span(q.coeffs().data(), 4)), crc);
  }
  const std::uint64_t events = pass.gyro.size() + pass.star_tracker.size();
  return events << 32 | crc;
}

std::string_view reason_of(Answer answer) {
  switch (answer) {
    case Answer::kCovarianceNotPositiveDefinite:
      return "the prior covariance is not positive definite";
    case Answer::kMeanNotUsable:
      return "a prior mean is not finite";
    case Answer::kTooLarge:
      return "the on-board application takes two or three gyros";
    default:
      return "a noise, a gate, a period or a requirement is not finite or not positive";
  }
}

/// What is left of `given` where so many have been dealt with.
std::uint64_t left_of(std::uint64_t given, std::uint64_t dealt_with) { return given - std::min(given, dealt_with); }

NotTaken not_taken_of(const Housekeeping& record, const Events::Position& given) {
  const auto sum = [](auto... counts) { return (std::uint64_t{counts} + ...); };
  return {left_of(given.samples, sum(record.samples_used, record.samples_thinned, record.samples_rejected)),
          left_of(given.fixes[0], sum(record.fixes_used, record.fixes_rejected))};
}

/// Why, by the record: the application does not look at anything once it has failed.
std::string reason_of_failure(const Housekeeping& record, int gyros) {
  std::string text;
  for (int k = 0; k < gyros; ++k) {
    if (const auto state = static_cast<GyroState>(record.gyros[k]); state != GyroState::kUsed) {
      text += fmt::format("gyro {} {}; ", k + 1, name_of(state));
    }
  }
  return text + fmt::format("the last sample {}", name_of(static_cast<SampleStatus>(record.last_sample)));
}

Verdict verdict_of(const Housekeeping& record, const Parameters& parameters, Time epoch, const NotTaken& not_taken) {
  Verdict verdict;
  const bool has_failed = static_cast<Mode>(record.mode) == Mode::kFailed;
  verdict.trustworthy = record.adopted != 0 && !has_failed;
  if (has_failed) {
    verdict.findings.push_back(
        {FindingCode::kApplicationFailed,
         fmt::format("The on-board application failed at {:.1f} min: it had been without attitude for longer than "
                     "{:.3g} s. From then on it took no input.",
                     to_seconds(Time(Duration(record.time_ns)) - epoch) / 60,
                     to_seconds(Duration(parameters.failed_after_ns))),
         fmt::format("{}; not taken: {} samples, {} fixes",
                     reason_of_failure(record, static_cast<int>(parameters.gyros)), not_taken.samples, not_taken.fixes),
         "Look at the readings of the gyros before that time; on board only the command reset leads on from here."});
  } else if (!verdict.trustworthy) {
    verdict.findings.push_back(
        {FindingCode::kNotAdopted, "The on-board application navigates without this calibration.",
         fmt::format("adopted {} times, taken back {} times; {}", record.adoptions, record.withdrawals,
                     record.predicted != 0 ? fmt::format("predicted error {:.3g} rad, required {:.3g} rad",
                                                         record.predicted_error_rad, record.required_error_rad)
                                           : "nothing was predicted yet"),
         "Give a longer pass with more slews, or require less."});
  }
  return verdict;
}

template <class Application>
class FlownAs final : public detail::FlownApplication {
 public:
  using Step = ApplicationReplay::Step;
  using Saved = ApplicationReplay::Saved;
  using Resumed = ApplicationReplay::Resumed;
  using Store = SnapshotStore<State<Application>>;

  FlownAs(const Pass& pass, const Parameters& parameters) : pass_(pass), parameters_(parameters), events_(pass, 1) {
    state_->ground.replay = mark_of(pass, parameters);
    if (const Answer answer = application().load(parameters); answer != Answer::kAccepted) {
      throw SetupError(std::string(reason_of(answer)), "correct settings and requirements");
    }
    TRIHEDRON_ASSERT(application().command(Command::kStart) == Answer::kAccepted);
  }

  [[nodiscard]] std::optional<Time> next_t() const override { return events_.next_t(); }

  const Step& feed() override {
    const auto event = events_.next();
    step_.attitude.reset();
    if (const auto* sample = std::get_if<GyroSample>(&event.value())) {
      step_.report = application().on_gyro(*sample);
      step_.attitude = application().attitude();
      if (step_.report.sample != SampleStatus::kUsed) {
        step_.attitude.reset();
      }
    } else {
      step_.report = application().on_fix(std::get<StarFix>(*event));
    }
    GroundPart& part = state_->ground;
    part.position = events_.position();
    if (step_.attitude) {
      ++part.attitudes;
      step_.age_s = to_seconds(step_.report.t - application().on_board().corrected_t());
    }
    if (const FixStatus fix = step_.report.fix.status; fix != FixStatus::kNone && fix != FixStatus::kPending) {
      part.fixes.add(record_of(step_.report, layout().gyros));
    }
    return step_;
  }

  [[nodiscard]] Mode mode() const override { return application().mode(); }
  [[nodiscard]] Housekeeping housekeeping() const override { return application().housekeeping(); }

  [[nodiscard]] std::optional<Calibration> calibration() const override {
    const auto& on_board = application().on_board();
    if (!on_board.estimator().started() || !on_board.latest()) {
      return std::nullopt;
    }
    Calibration calibration = calibration_of(on_board, pass_.settings.epoch);
    const Eigen::Vector3d& noise_rad = on_board.estimator().setup().star_trackers[0].noise_rad;
    if (noise_rad != pass_.settings.star_tracker_noise_rad) {
      calibration.noise->star_tracker_noise_rad = noise_rad;
    }
    state_->ground.fixes.put_into(calibration.statistics);
    calibration.verdict = verdict();
    return calibration;
  }

  [[nodiscard]] Verdict verdict() const override {
    return verdict_of(housekeeping(), parameters_, pass_.settings.epoch, not_taken());
  }

  [[nodiscard]] NotTaken not_taken() const override { return not_taken_of(housekeeping(), state_->ground.position); }

  [[nodiscard]] std::uint64_t attitudes() const override { return state_->ground.attitudes; }

  [[nodiscard]] std::size_t snapshots_size() const override { return Store::kSize; }

  Saved save(std::span<std::byte> memory, const ConfirmedOutput& output) override {
    state_->ground.output = output;
    Saved saved{Store::save(*state_, memory), 0, Store::kSlotSize};
    SnapshotHeader second;
    std::memcpy(&second, memory.subspan(Store::kSlotSize).data(), sizeof second);
    saved.offset = second.sequence == saved.sequence ? Store::kSlotSize : 0;
    return saved;
  }

  Resumed resume(std::span<const std::byte> memory) override {
    ZeroedState<State<Application>> state;
    const auto restored = Store::restore(memory, *state);
    Resumed resumed{restored.slots, restored.sequence, false, state->ground.output};
    if (restored.ok() && fits(*state)) {
      resumed.is_of_this_replay = true;
      state_ = std::move(state);
      events_ = Events(pass_, 1, state_->ground.position);
    }
    return resumed;
  }

 private:
  /// Whether a state is of this replay: what marks it, the layout that the parameters have, and a place in the pass.
  [[nodiscard]] bool fits(const State<Application>& state) const {
    const GroundPart& part = state.ground;
    const auto& [samples, fixes] = part.position;
    const bool is_in_pass = samples <= pass_.gyro.size() && fixes[0] <= pass_.star_tracker.size() &&
                            std::all_of(fixes.begin() + 1, fixes.end(), [](std::uint64_t taken) { return taken == 0; });
    return part.replay == state_->ground.replay && is_in_pass && part.attitudes <= samples &&
           state.application.on_board().estimator().layout() == layout();
  }
  [[nodiscard]] Application& application() { return state_->application; }
  [[nodiscard]] const Application& application() const { return state_->application; }
  [[nodiscard]] const Layout& layout() const { return application().on_board().estimator().layout(); }

  const Pass& pass_;
  Parameters parameters_;
  Events events_;
  ZeroedState<State<Application>> state_;
  Step step_;
};

}  // namespace

ApplicationReplay::ApplicationReplay(const Pass& pass, const Parameters& parameters) {
  if (parameters.gyros == 2) {
    flown_ = std::make_unique<FlownAs<PairApplication>>(pass, parameters);
  } else {
    flown_ = std::make_unique<FlownAs<TrioApplication>>(pass, parameters);
  }
}

ApplicationReplay::ApplicationReplay(ApplicationReplay&&) noexcept = default;
ApplicationReplay& ApplicationReplay::operator=(ApplicationReplay&&) noexcept = default;
ApplicationReplay::~ApplicationReplay() = default;

std::optional<Time> ApplicationReplay::next_t() const { return flown_->next_t(); }
const ApplicationReplay::Step& ApplicationReplay::feed() { return flown_->feed(); }
Mode ApplicationReplay::mode() const { return flown_->mode(); }
Housekeeping ApplicationReplay::housekeeping() const { return flown_->housekeeping(); }
Verdict ApplicationReplay::verdict() const { return flown_->verdict(); }
NotTaken ApplicationReplay::not_taken() const { return flown_->not_taken(); }
std::optional<Calibration> ApplicationReplay::calibration() const { return flown_->calibration(); }
std::uint64_t ApplicationReplay::attitudes() const { return flown_->attitudes(); }
std::size_t ApplicationReplay::snapshots_size() const { return flown_->snapshots_size(); }

ApplicationReplay::Saved ApplicationReplay::save(std::span<std::byte> memory, const ConfirmedOutput& output) {
  return flown_->save(memory, output);
}

ApplicationReplay::Resumed ApplicationReplay::resume(std::span<const std::byte> memory) {
  return flown_->resume(memory);
}

}  // namespace trihedron::ground
