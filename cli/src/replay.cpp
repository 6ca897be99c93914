#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "decisions.hpp"
#include "replay_view.hpp"
#include "summary.hpp"
#include "trihedron/ground/application/application_replay.hpp"
#include "trihedron/ground/application/parameters.hpp"
#include "trihedron/ground/application/play.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/onboard/events.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/lasting_file.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/records/application_names.hpp"
#include "trihedron/records/readiness.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

namespace fs = std::filesystem;

constexpr auto kBetweenSnapshots = std::chrono::milliseconds(250);

/// Of a replay; an empty path is none.
struct ReplayFiles {
  fs::path attitude;
  fs::path calibration;
  fs::path state;
  fs::path records;
  fs::path config;  ///< that the options were read from
};

struct ReplayRequest {
  fs::path pass;
  ReplayFiles files;
  CalibrationOptions options;
  ground::Required required;
  double speed = 1;
  bool resume = false;
};

std::string_view text_of(SnapshotAnswer answer) {
  switch (answer) {
    case SnapshotAnswer::kRestored:
      return "the newest";
    case SnapshotAnswer::kOlder:
      return "an older one";
    case SnapshotAnswer::kForeign:
      return "none of this program and number of gyros";
    case SnapshotAnswer::kCorrupted:
      return "a torn or damaged one";
    case SnapshotAnswer::kTooSmall:
      break;
  }
  return "nothing: the file is too short";
}

std::string slots_text(const std::array<SnapshotAnswer, 2>& slots) {
  return fmt::format("slot 1 {}, slot 2 {}", text_of(slots[0]), text_of(slots[1]));
}

/// The attitude and the snapshots of a replay: what is on the disk, and what is still to be put there.
class Keeper {
 public:
  Keeper(const ReplayRequest& request, const io::LoadedPass& loaded, const Parameters& parameters,
         ground::ApplicationReplay& replay, const Common& common)
      : request_(request),
        replay_(replay),
        epoch_(loaded.pass.settings.epoch),
        mounting_(loaded.pass.settings.star_tracker_mounting_rotation_vector_rad) {
    const fs::path& state = request.files.state;
    std::error_code ignored;
    const bool is_there = !state.empty() && fs::exists(state, ignored);
    if (request.resume && is_there) {
      resume(common);
      return;
    }
    if (request.resume) {
      common.log.say(fmt::format("{} is not there: the replay begins", state.string()));
    }
    if (is_there) {
      refuse_to_replace(loaded.pass, parameters);
      fs::remove(state);  // before the attitude that it counts on goes
    }
    if (!request.files.attitude.empty() && !to_stdout()) {
      attitude_.emplace(io::GrowingFile::begin(request.files.attitude));
    }
    put(io::attitude_header(mounting_));
    if (!state.empty()) {
      memory_.resize(replay_.snapshots_size());
      save();
      state_.emplace(io::SlotFile::begin(state, memory_));
    }
  }

  void add(const ground::ApplicationReplay::Step& step) {
    if (!request_.files.attitude.empty() && step.attitude) {
      ground::append(rows_, step.report.t, *step.attitude);
      rows_.age_s.push_back(step.age_s);
    }
    t_ = step.report.sample != SampleStatus::kNone ? step.report.t : t_;
  }

  /// Now and then; whether something has been confirmed.
  bool look(ground::Clock::time_point now) {
    if (next_ && now < *next_) {
      return false;
    }
    next_ = now + kBetweenSnapshots;
    return confirm();
  }

  /// Brings all that came out to where it is kept; whether that is confirmed.
  bool confirm() {
    const StopScope nothing_stops(nullptr);  // rows that have been taken must arrive
    put(io::format_attitude_rows(epoch_, std::exchange(rows_, {}), io::AttitudeDigits::kTwelveDecimals, {}, mounting_));
    if (!state_) {
      return false;
    }
    if (attitude_) {
      attitude_->synchronise();  // before the snapshot that counts on it
    }
    const ground::ApplicationReplay::Saved saved = save();
    state_->put(saved.offset, std::span(memory_).subspan(saved.offset, saved.size));
    confirmed_ = t_;
    return confirmed_.has_value();
  }

  [[nodiscard]] std::optional<Time> confirmed() const { return confirmed_; }
  [[nodiscard]] std::uint64_t snapshots() const { return snapshots_; }
  [[nodiscard]] std::optional<Time> resumed() const { return resumed_; }

 private:
  [[nodiscard]] bool to_stdout() const { return request_.files.attitude == kStandardStream; }

  void put(std::string_view text) {
    if (attitude_) {
      attitude_->append(text);
    } else if (to_stdout()) {
      print_data(stdout, text);
      std::fflush(stdout);
    }
  }

  ground::ApplicationReplay::Saved save() {
    ground::ConfirmedOutput output;
    if (attitude_) {
      output = {attitude_->size(), attitude_->crc(), 1};
    }
    const ground::ApplicationReplay::Saved saved = replay_.save(memory_, output);
    snapshots_ = saved.sequence;
    return saved;
  }

  void resume(const Common& common) {
    const fs::path& path = request_.files.state;
    state_.emplace(io::SlotFile::open(path));
    memory_ = state_->content();
    const ground::ApplicationReplay::Resumed resumed = replay_.resume(memory_);
    if (resumed.sequence == 0) {
      throw io::InputRefused(path, {}, fmt::format("holds no whole snapshot: {}", slots_text(resumed.slots)),
                             "give the state of this replay, or begin anew without --resume and with another file");
    }
    if (!resumed.is_of_this_replay) {
      throw io::InputRefused(path, {}, "is the state of another pass, or was begun with other settings",
                             "give the pass and the settings that it was begun with, or another state");
    }
    if ((resumed.output.is_kept != 0) == request_.files.attitude.empty()) {
      throw io::InputRefused(
          path, {},
          resumed.output.is_kept != 0 ? "was begun with a file of attitude" : "was begun without a file of attitude",
          resumed.output.is_kept != 0 ? "give it with -o" : "leave out -o");
    }
    if (resumed.output.is_kept != 0) {
      attitude_.emplace(io::GrowingFile::carry_on(request_.files.attitude, resumed.output.bytes, resumed.output.crc));
    }
    memory_.resize(replay_.snapshots_size());
    snapshots_ = resumed.sequence;
    resumed_ = confirmed_ = t_ = Time(Duration(replay_.housekeeping().time_ns));
    common.log.say(
        fmt::format("goes on from snapshot {} of {}: {}", resumed.sequence, path.string(), slots_text(resumed.slots)));
  }

  /// Unless the state is that of this replay, ended, or nothing.
  void refuse_to_replace(const Pass& pass, const Parameters& parameters) const {
    const fs::path& path = request_.files.state;
    const io::SlotFile file = io::SlotFile::open(path);
    ground::ApplicationReplay scratch(pass, parameters);
    const ground::ApplicationReplay::Resumed found = scratch.resume(file.content());
    const bool has_ended = found.is_of_this_replay && !scratch.next_t();
    if (!has_ended && !file.content().empty()) {
      throw io::UsageError(fmt::format(
          "{}: {}", path.string(),
          found.is_of_this_replay ? "holds this replay, broken off; --resume goes on with it, or remove the file"
                                  : "is there and is no state of this replay; remove it, or give another file"));
    }
  }

  const ReplayRequest& request_;
  ground::ApplicationReplay& replay_;
  Time epoch_;
  io::Mounting mounting_;
  AttitudeHistory rows_;  ///< not yet put anywhere
  std::optional<io::GrowingFile> attitude_;
  std::optional<io::SlotFile> state_;
  std::vector<std::byte> memory_;
  std::uint64_t snapshots_ = 0;
  std::optional<Time> t_;
  std::optional<Time> confirmed_;
  std::optional<Time> resumed_;
  std::optional<ground::Clock::time_point> next_;
};

nlohmann::ordered_json durations_json(const ground::Durations& durations) {
  const auto seconds = [](ground::Clock::duration duration) { return std::chrono::duration<double>(duration).count(); };
  return {{"count", durations.count()},
          {"p50_s", seconds(durations.percentile(0.5))},
          {"p99_s", seconds(durations.percentile(0.99))},
          {"p999_s", seconds(durations.percentile(0.999))},
          {"longest_s", seconds(durations.longest())}};
}

/// What a replay has come to.
struct ReplayResult {
  const io::LoadedPass& loaded;
  Housekeeping record;
  Verdict verdict;
  std::optional<Calibration> calibration;  ///< nothing where no fix could be used
  std::uint64_t attitudes = 0;
  ground::NotTaken not_taken;
  const ground::Timing& timing;
  const Keeper& keeper;
};

nlohmann::ordered_json result_json(const ReplayResult& result) {
  const Housekeeping& record = result.record;
  const Time epoch = result.loaded.pass.settings.epoch;
  nlohmann::ordered_json faults = nlohmann::ordered_json::array();
  for (const FaultRow& row : kFaultRows) {
    if ((record.faults & static_cast<std::uint32_t>(row.fault)) != 0) {
      faults.push_back(row.name);
    }
  }
  nlohmann::ordered_json json = {
      {"pass", pass_json(result.loaded)},
      {"verdict", verdict_json(result.verdict)},
      {"statistics", statistics_json(result.calibration ? result.calibration->statistics : Statistics{})},
      {"mode", name_of(static_cast<Mode>(record.mode))},
      {"faults", faults},
      {"readiness_s", readiness_s(record)},
      {"predicted_error_rad", record.predicted != 0 ? nlohmann::ordered_json(record.predicted_error_rad) : nullptr},
      {"adoptions", record.adoptions},
      {"withdrawals", record.withdrawals},
      {"samples_used", record.samples_used},
      {"samples_thinned", record.samples_thinned},
      {"samples_rejected", record.samples_rejected},
      {"fixes_used", record.fixes_used},
      {"fixes_rejected", record.fixes_rejected},
      {"samples_not_taken", result.not_taken.samples},
      {"fixes_not_taken", result.not_taken.fixes},
      {"attitudes", result.attitudes},
      {"snapshots", result.keeper.snapshots()},
      {"calls", durations_json(result.timing.calls)},
      {"late", durations_json(result.timing.late)}};
  if (const auto resumed = result.keeper.resumed()) {
    json["resumed_s"] = to_seconds(*resumed - epoch);
  }
  return json;
}

std::string_view why_not_taken(const ground::NotTaken& not_taken) {
  if (not_taken.samples > 0) {
    return ": it had failed";
  }
  return not_taken.fixes > 0
             ? ": at the start it looks at none; at the end the samples after a fix are missing; a jump "
               "of the clock loses some"
             : "";
}

std::string result_text(const ReplayResult& result, const ReplayRequest& request) {
  const Housekeeping& record = result.record;
  std::string text = pass_text(result.loaded) + verdict_text(result.verdict);
  auto out = std::back_inserter(text);
  fmt::format_to(out, "Mode        {}; faults: {}\nReadiness   {}\n", name_of(static_cast<Mode>(record.mode)),
                 faults_text(record.faults), readiness_in_words(record));
  fmt::format_to(out, "Adoptions   {}, taken back {}\n", record.adoptions, record.withdrawals);
  fmt::format_to(out, "Samples     {} used, {} thinned, {} rejected\n", record.samples_used, record.samples_thinned,
                 record.samples_rejected);
  fmt::format_to(out, "Fixes       {} used, {} rejected\n", record.fixes_used, record.fixes_rejected);
  const ground::NotTaken& not_taken = result.not_taken;
  fmt::format_to(out, "Not taken   {} samples, {} fixes{}\n", not_taken.samples, not_taken.fixes,
                 why_not_taken(not_taken));
  fmt::format_to(out, "Call        {}\n", percentiles_text(result.timing.calls));
  if (result.timing.late.count() > 0) {
    fmt::format_to(out, "Late        {}\n", percentiles_text(result.timing.late));
  }
  const ReplayFiles& files = request.files;
  if (!files.attitude.empty()) {
    fmt::format_to(out, "Written     {}: {} epochs\n", printable(files.attitude.string()), result.attitudes);
  }
  if (!files.calibration.empty()) {
    fmt::format_to(out, "{:<12}{}\n", result.calibration ? "Written" : "Not written",
                   result.calibration ? printable(files.calibration.string()) : "a calibration: no fix could be used");
  }
  if (!files.state.empty()) {
    fmt::format_to(out, "Confirmed   all, by snapshot {} in {}\n", result.keeper.snapshots(),
                   printable(files.state.string()));
  }
  return text;
}

/// What the application is given, as records of trihedron_tables.h, each after its kind: for programs in C, such as
/// examples/c/replayed.c.
void write_records(const fs::path& path, const Pass& pass, const Parameters& parameters) {
  enum class Kind : std::uint64_t { kParameters, kSample, kFix };
  constexpr std::size_t kBlock = std::size_t{1} << 20U;
  io::AtomicFile file(path);
  std::string block;
  const auto put = [&](Kind kind, const auto& record) {
    block.append(reinterpret_cast<const char*>(&kind), sizeof kind);
    block.append(reinterpret_cast<const char*>(&record), sizeof record);
    if (block.size() > kBlock) {
      file.write(std::exchange(block, {}));
    }
  };
  put(Kind::kParameters, parameters);
  ground::Events events(pass, 1);
  while (const auto event = events.next()) {
    if (const auto* fix = std::get_if<StarFix>(&*event)) {
      StarFixRecord record{fix->t.time_since_epoch().count(), {}};
      Eigen::Map<Eigen::Vector4d>(record.q_in_c) = fix->q_in_c.coeffs();
      put(Kind::kFix, record);
    } else {
      const auto& sample = std::get<GyroSample>(*event);
      GyroSampleRecord record{sample.t.time_since_epoch().count(), {}};
      for (int k = 0; k < std::min(pass.gyro.gyros, TRIHEDRON_MAX_GYROS); ++k) {
        Eigen::Map<Eigen::Vector3d>(record.h_b[k]) = sample.h_b[k];
      }
      put(Kind::kSample, record);
    }
  }
  file.write(block);
  file.commit();
}

void expect_apart(const ReplayRequest& request, const io::LoadedPass& loaded) {
  const ReplayFiles& files = request.files;
  std::vector<fs::path> inputs = io::inputs_of(request.pass, loaded);
  inputs.push_back(files.config);
  std::vector<fs::path> outputs = {files.calibration, files.state, files.records};
  for (const fs::path& output : outputs) {
    if (output == kStandardStream) {
      throw io::UsageError("the attitude alone can be written to standard output: name a file for the others");
    }
  }
  if (files.attitude != kStandardStream) {
    outputs.push_back(files.attitude);
  }
  io::expect_apart_from_each_other(outputs);
  io::expect_apart(inputs, outputs);
}

/// What `set_up` gives; of an error in the settings it is told with the pass that has them.
template <class SetUp>
auto of_pass(const fs::path& pass, SetUp&& set_up) {
  try {
    return set_up();
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(pass, {}, error.what(), error.cure());
  }
}

/// Plays all of it. What was confirmed stays so, whatever ends it; a signal confirms what there is.
void play_on(ground::ApplicationReplay& replay, const ReplayRequest& request, ground::Timing& timing, ReplayView& view,
             Keeper& keeper) {
  const auto confirmed = [&](bool is_confirmed) {
    if (is_confirmed) {
      view.confirmed(*keeper.confirmed());
    }
  };
  try {
    ground::play(
        replay, request.speed, timing,
        [&](const ground::ApplicationReplay::Step& step) {
          keeper.add(step);
          view.note(step.report);
        },
        [&](ground::Clock::time_point now) {
          confirmed(keeper.look(now));
          view.look(now);
        });
  } catch (const Stopped&) {
    keeper.confirm();
    throw;
  }
  confirmed(keeper.confirm());
  view.end();
}

ExitStatus replay_pass(const ReplayRequest& request, const Common& common) {
  const io::LoadedPass loaded = io::read_pass(request.pass);
  log_pass(common.log, request.pass.string(), loaded);
  log_settings(common.log, request.options);
  expect_apart(request, loaded);
  if (!request.files.calibration.empty()) {
    io::expect_writable(request.files.calibration);
  }
  const Parameters parameters =
      of_pass(request.pass, [&] { return parameters_of(loaded.pass.settings, request.options, request.required); });
  auto replay = of_pass(request.pass, [&] { return ground::ApplicationReplay(loaded.pass, parameters); });
  Keeper keeper(request, loaded, parameters, replay, common);
  if (!request.files.records.empty()) {
    write_records(request.files.records, loaded.pass, parameters);
  }
  const Common beside_attitude = beside(request.files.attitude.string(), common);
  ground::Timing timing;
  {
    ReplayView view(beside_attitude, replay, loaded.pass.settings, request.speed, timing);
    play_on(replay, request, timing, view, keeper);
  }
  const std::optional<Calibration> calibration = replay.calibration();
  if (calibration && !request.files.calibration.empty()) {
    io::write_calibration(request.files.calibration, *calibration);
  }
  const ReplayResult result{
      loaded, replay.housekeeping(), replay.verdict(), calibration, replay.attitudes(), replay.not_taken(), timing,
      keeper};
  log_verdict(common.log, result.verdict);
  show(
      beside_attitude, [&] { return result_json(result); }, [&] { return result_text(result, request); });
  return result.verdict.trustworthy ? kTrustworthy : kDoNotUse;
}

double speed_of(const std::string& text) {
  constexpr std::string_view kMax = "max";
  if (text == kMax) {
    return ground::kAtOnce;
  }
  try {
    return io::parse_number(text, limits::kSpeed);
  } catch (const io::UsageError& error) {
    throw io::UsageError(
        fmt::format("--speed: {}; give 1 for real time, another positive number, or max", error.what()));
  }
}

}  // namespace

void add_replay(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string pass;
    std::string speed = "1";
    std::string interval;
    std::string required_error;
    std::string required_interval;
    std::string window;
    int spread_over = 0;
    std::string attitude;
    std::string calibration;
    std::string state;
    std::string records;
    bool resume = false;
    std::string config;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand(
      "replay", "Feed the on-board application by the clock, and show what it does: a live screen in a terminal");
  command->add_option("PASS", arguments->pass, "Directory, NetCDF file or telemetry.toml, of two or three gyros")
      ->required();
  command->add_option("--speed", arguments->speed, "Times real time; max, as fast as can be")
      ->capture_default_str()
      ->type_name("NUMBER|max");
  command->add_option("-o,--output", arguments->attitude, "Attitude file to write (CSV); - for standard output")
      ->type_name("FILE");
  command->add_option("--calibration", arguments->calibration, "Calibration to write at the end, as calibration.json")
      ->type_name("FILE");
  command
      ->add_option(
          "--records", arguments->records,
          "Write what the application is given: parameters, samples, fixes, as records of trihedron_tables.h for "
          "a program in C (examples/c/replayed.c)")
      ->type_name("FILE");
  auto* state =
      command
          ->add_option("--state", arguments->state,
                       "Keep snapshots here, four a second. What comes before the newest one is confirmed: it and its "
                       "attitude are on the disk, and neither kill -9 nor a loss of power takes them back")
          ->type_name("FILE");
  command
      ->add_flag(
          "--resume", arguments->resume,
          "Go on from the newest snapshot, or begin where there is no file yet: what is after it in the attitude "
          "file is cut off and made again, and the end is that of a replay that nothing broke off, bit for bit")
      ->needs(state);
  command
      ->add_option(
          "--correction-interval", arguments->interval,
          "Time between astro-corrections: none, only the first; continuous, each fix, unless the settings say "
          "otherwise")
      ->type_name("DURATION|none|continuous");
  const ground::Required usual = ground::Required::usual();
  arguments->required_error = "5arcmin";
  arguments->required_interval = io::format_duration(usual.interval);
  arguments->window = io::format_duration(usual.window);
  arguments->spread_over = usual.spread_over;
  command
      ->add_option(
          "--required-error", arguments->required_error,
          "Error of the attitude, 99.7 %, that a calibration has to keep without the star tracker before it is "
          "adopted")
      ->capture_default_str()
      ->type_name("ANGLE");
  command->add_option("--required-interval", arguments->required_interval, "For so long")
      ->capture_default_str()
      ->type_name("DURATION");
  command
      ->add_option("--window", arguments->window,
                   "Stretch from which that is predicted, an orbit: nothing is adopted before it has been flown")
      ->capture_default_str()
      ->type_name("DURATION");
  command
      ->add_option("--spread-over", arguments->spread_over,
                   "Samples over which the work of a fix is spread, so that no call takes long; 0, it is done at once, "
                   "as navigate does it")
      ->capture_default_str()
      ->check(whole(limits::kSpreadOver))
      ->type_name("SAMPLES");
  const auto settle = [arguments] {
    CalibrationOptions options = settings_of(arguments->config);
    if (arguments->config.empty()) {
      options.corrections.when = CorrectionOptions::When::kEachFix;
    }
    if (!arguments->interval.empty()) {
      options.corrections =
          of_option("--correction-interval", [&] { return io::parse_correction_interval(arguments->interval); });
    }
    return options;
  };
  add_config(*command, arguments->config, settle);
  command->footer(
      "# A pass in real time, and as fast as can be\n"
      "trihedron replay pass.nc\n"
      "trihedron replay pass.nc --speed max -o attitude.csv --calibration calibration.json\n"
      "# So that it can be killed and carried on\n"
      "trihedron replay pass.nc --speed 100 -o attitude.csv --state replay.state --resume");
  command->callback([&common, &exit_status, arguments, settle] {
    ReplayRequest request;
    request.pass = arguments->pass;
    request.files = {arguments->attitude, arguments->calibration, arguments->state, arguments->records,
                     arguments->config};
    request.speed = speed_of(arguments->speed);
    request.required.error_rad = of_option(
        "--required-error", [&] { return io::parse_angle_rad(arguments->required_error, limits::kAttitudeLimit_rad); });
    request.required.interval = of_option("--required-interval", [&] {
      return io::parse_duration(arguments->required_interval, limits::kRequiredInterval_s);
    });
    request.required.window =
        of_option("--window", [&] { return io::parse_duration(arguments->window, limits::kPredictionWindow_s); });
    request.required.spread_over = arguments->spread_over;
    request.options = settle();
    request.resume = arguments->resume;
    if (!request.files.state.empty() && request.files.attitude == kStandardStream) {
      throw io::UsageError("--state: standard output cannot be carried on; give -o a file, or leave it out");
    }
    exit_status = replay_pass(request, common);
  });
}

}  // namespace trihedron::cli
