#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>
#include <system_error>

#include "acm_keywords.hpp"
#include "attitude_rules.hpp"
#include "ccsds_frames.hpp"
#include "ck_reader.hpp"
#include "ndm_message.hpp"
#include "netcdf_input.hpp"
#include "text_file.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/calibration_message.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/limits.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kAcmBlocks = {
    {{"ATT", "att"}, {"PHYS", "phys"}, {"COV", "cov"}, {"MAN", "man"}, {"AD", "ad"}, {"USER", "user"}}};
constexpr std::array<std::string_view, 19> kAcmMetadata = {"OBJECT_NAME",        "INTERNATIONAL_DESIGNATOR",
                                                           "CATALOG_NAME",       "OBJECT_DESIGNATOR",
                                                           "ORIGINATOR_POC",     "ORIGINATOR_POSITION",
                                                           "ORIGINATOR_PHONE",   "ORIGINATOR_EMAIL",
                                                           "ORIGINATOR_ADDRESS", "ODM_MSG_LINK",
                                                           "CENTER_NAME",        "TIME_SYSTEM",
                                                           "EPOCH_TZERO",        "ACM_DATA_ELEMENTS",
                                                           "START_TIME",         "STOP_TIME",
                                                           "TAIMUTC_AT_TZERO",   "NEXT_LEAP_EPOCH",
                                                           "NEXT_LEAP_TAIMUTC"};
constexpr NdmKind kAcm = {"ACM", kAcmBlocks, kAcmMetadata};

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = text.find_first_not_of(" \t"); begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \t", begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = std::min(text.find_first_not_of(" \t", end), text.size());
  }
  return words;
}

/// From an ACM to a calibration.
class AcmReader {
 public:
  AcmReader(std::string_view text, const std::filesystem::path& file)
      : file_(file), message_(text, file, kAcm), clock_(message_.time_scale()) {}

  CalibrationMessage read() {
    take_metadata();
    take_rows();
    take_manoeuvres();
    user_ = message_.block("USER");
    if (user_ == nullptr) {
      message_.refuse(message_.end, "the message has no block USER, which holds the calibration",
                      "give one that export --format acm wrote");
    }
    take_verdict();
    calibration().estimator = estimator();
    calibration().t = calibration().epoch + from_seconds(number("EPOCH_S", limits::kTimeOfCalibration_s));
    if (const NdmEntry* start_up = optional("START_UP")) {
      calibration().start_up = start_up->value;
    }
    const std::size_t gyros = count("GYROS", kMaxGyros);
    for (std::size_t k = 0; k < gyros; ++k) {
      take_gyro(k);
    }
    take_clocks();
    take_noise();
    take_field();
    if (optional("DETERMINED") != nullptr) {
      constexpr int kMost = Layout::kEq1 * kMaxGyros;
      calibration().determined = {static_cast<int>(count("DETERMINED", kMost, 0)),
                                  static_cast<int>(count("DETERMINED_OF", kMost, 0))};
    }
    ignore_sensors();
    if (optional("ORBITAL_RATE_RAD_S") != nullptr) {
      for (GyroCalibration& gyro : calibration().gyros) {
        gyro.orbital_drift = OrbitalDrift{
            {0, 0, 0}, {0, 0, 0}, number("ORBITAL_RATE_RAD_S", limits::kOrbitalRate_rad_s), calibration().epoch};
      }
    }
    take_rest();
    take_covariance();
    // What the message says one by one must fit together as calibration.json must.
    const std::filesystem::path& last = result_.has_full_covariance ? result_.covariance_file : file_;
    static_cast<void>(parse_calibration(format_calibration(calibration()), last));
    return std::move(result_);
  }

 private:
  Calibration& calibration() { return result_.calibration; }

  void take_metadata() {
    result_.format = message_.format;
    result_.object_name = message_.needed(message_.metadata, "OBJECT_NAME").value;
    const auto id = message_.metadata.entries.find("INTERNATIONAL_DESIGNATOR");
    result_.object_id = id != message_.metadata.entries.end() ? id->second.value : "UNKNOWN";
    if (clock_.scale() == TimeScale::kTdb) {
      message_.refuse(message_.needed(message_.metadata, "TIME_SYSTEM").at,
                      "TIME_SYSTEM is TDB, whose seconds are not those of a calibration",
                      "give the message in TAI, UTC, GPS or TT");
    }
    result_.time_system = name_of(clock_.scale());
    const NdmEntry& zero = message_.needed(message_.metadata, "EPOCH_TZERO");
    calibration().epoch = message_.time(clock_, zero.value, zero.at);
    const NdmBlock* determination = message_.block("AD");
    if (determination == nullptr) {
      message_.refuse(message_.end, "the message has no block AD, which names the frames", "write the file again");
    }
    const auto [inertial, body] = message_.frames(*determination);
    for (const NdmBlock& block : message_.blocks) {
      if (block.name == "ATT" && message_.frames(block) != std::pair(inertial, body)) {
        message_.refuse(block.at, "the frames of ATT are not those of AD", "give them in the same frames");
      }
    }
    if (is_inertial_frame(body)) {
      message_.refuse(determination->at, "REF_FRAME_A is that of the spacecraft, REF_FRAME_B inertial",
                      "exchange them");
    }
    result_.inertial_frame = inertial;
    result_.body_frame = body;
  }

  /// Relative seconds or an epoch, as the standard lets relative times be given.
  [[nodiscard]] Time instant(std::string_view text, Position at) {
    if (text.find('T') != std::string_view::npos) {
      return message_.time(clock_, text, at);
    }
    const double seconds = message_.number(text, at);
    if (!limits::kTimeOfCalibration_s.holds(seconds)) {
      message_.refuse(at, fmt::format("the time {}", is_outside(seconds, limits::kTimeOfCalibration_s)),
                      "it counts from EPOCH_TZERO");
    }
    return calibration().epoch + from_seconds(seconds);
  }

  /// Attitude and its covariance are no part of a calibration, but what is damaged there is damaged elsewhere too.
  void take_rows() {
    std::optional<Time> start;
    std::optional<Time> stop;
    const auto& entries = message_.metadata.entries;
    if (const auto found = entries.find("START_TIME"); found != entries.end()) {
      start = instant(found->second.value, found->second.at);
    }
    if (const auto found = entries.find("STOP_TIME"); found != entries.end()) {
      stop = instant(found->second.value, found->second.at);
      if (start && *stop < *start) {
        message_.refuse(found->second.at, "STOP_TIME is before START_TIME", "correct them");
      }
    }
    for (const NdmBlock& block : message_.blocks) {
      if (block.name != "ATT" && block.name != "COV") {
        continue;
      }
      std::size_t values = 3;
      if (block.name == "ATT") {
        const NdmEntry& states = message_.needed(block, "NUMBER_STATES");
        const double told = message_.number(states.value, states.at);
        if (!(told >= 1 && told <= 100) || told != std::floor(told)) {
          message_.refuse(states.at, fmt::format("NUMBER_STATES is {}", states.value), "give how many are in a line");
        }
        values = static_cast<std::size_t>(told);
      }
      std::optional<Time> last;
      for (const NdmRow& row : block.rows) {
        check_stop();
        const std::vector<std::string_view> words = words_of(row.text);
        if (words.size() != values + 1) {
          message_.refuse(row.at, fmt::format("the line has {} values, not {}", words.size(), values + 1),
                          "a time and its numbers stand in a line");
        }
        const Time t = instant(words[0], row.at);
        if (last && t <= *last) {
          message_.refuse(row.at, fmt::format("the time {} is not later than the one before", in_quotes(words[0])),
                          "put the lines in order, each time once");
        }
        if ((start && t < *start) || (stop && t > *stop)) {
          message_.refuse(row.at, fmt::format("the time {} lies outside START_TIME and STOP_TIME", in_quotes(words[0])),
                          "correct these, or remove the line");
        }
        last = t;
        for (std::size_t i = 1; i < words.size(); ++i) {
          static_cast<void>(message_.number(words[i], row.at));
        }
      }
    }
  }

  void take_manoeuvres() {
    constexpr std::array<std::string_view, 11> kKnown = {
        "MAN_ID",        "MAN_PREV_ID",     "MAN_PURPOSE",      "MAN_BEGIN_TIME",  "MAN_END_TIME",   "MAN_DURATION",
        "ACTUATOR_USED", "TARGET_MOMENTUM", "TARGET_MOM_FRAME", "TARGET_ATTITUDE", "TARGET_SPINRATE"};
    for (const NdmBlock& block : message_.blocks) {
      if (block.name != "MAN") {
        continue;
      }
      for (const auto& [key, entry] : block.entries) {
        if (std::ranges::find(kKnown, key) == kKnown.end()) {
          message_.refuse(entry.at, fmt::format("{} is no keyword of MAN of an ACM", in_quotes(key)),
                          suggestion(key, kKnown));
        }
      }
      static_cast<void>(message_.needed(block, "MAN_PURPOSE"));
      Manoeuvre its;
      its.begin = time_of_manoeuvre(block, "MAN_BEGIN_TIME");
      const bool has_duration = block.entries.contains("MAN_DURATION");
      const NdmEntry& end = message_.needed(block, has_duration ? "MAN_DURATION" : "MAN_END_TIME");
      if (has_duration == block.entries.contains("MAN_END_TIME")) {
        message_.refuse(end.at, "MAN_END_TIME and MAN_DURATION are both there", "keep one of them");
      }
      if (has_duration) {
        const double duration_s = message_.number(block, "MAN_DURATION", "s");
        if (!limits::kTimeOfCalibration_s.holds(duration_s)) {
          message_.refuse(end.at, fmt::format("MAN_DURATION is {}", end.value), "give it in seconds");
        }
        its.end = its.begin + from_seconds(duration_s);
      } else {
        its.end = time_of_manoeuvre(block, "MAN_END_TIME");
      }
      if (its.end < its.begin) {
        message_.refuse(end.at, "the manoeuvre ends before it begins", "correct its times");
      }
      if (const auto target = block.entries.find("TARGET_ATTITUDE"); target != block.entries.end()) {
        const std::vector<std::string_view> words = words_of(target->second.value);
        Eigen::Quaterniond q(0, 0, 0, 0);
        for (std::size_t i = 0; i < words.size() && i < 4; ++i) {
          q.coeffs()(static_cast<int>(i)) = message_.number(words[i], target->second.at);
        }
        if (words.size() != 4 || !is_unit(q)) {
          message_.refuse(target->second.at, fmt::format("TARGET_ATTITUDE is {}", in_quotes(target->second.value)),
                          "give a unit quaternion, Q1 Q2 Q3 QC");
        }
        its.target_q_in_c = q;
      }
      result_.manoeuvres.push_back(its);
    }
  }

  [[nodiscard]] Time time_of_manoeuvre(const NdmBlock& block, std::string_view key) {
    const NdmEntry& entry = message_.needed(block, key);
    if (!entry.units.empty() && entry.units != "s") {
      message_.refuse(entry.at, fmt::format("the unit of {} is {}", key, in_quotes(entry.units)), "give it in s");
    }
    return instant(entry.value, entry.at);
  }

  [[nodiscard]] const NdmEntry* optional(std::string_view key) {
    const std::string whole = std::string(kAcmPrefix) + std::string(key);
    asked_.insert(whole);
    const auto found = user_->entries.find(whole);
    if (found == user_->entries.end()) {
      return nullptr;
    }
    if (!found->second.units.empty()) {
      message_.refuse(found->second.at, fmt::format("{} has a unit in brackets", whole),
                      "remove it: the unit is the end of the keyword");
    }
    return &found->second;
  }

  [[nodiscard]] const NdmEntry& needed(std::string_view key) {
    const NdmEntry* entry = optional(key);
    if (entry == nullptr) {
      message_.refuse(user_->at, fmt::format("the user-defined keywords have no {}{}", kAcmPrefix, key),
                      "add it, or export the calibration again");
    }
    return *entry;
  }

  [[nodiscard]] double number_of(std::string_view key, const NdmEntry& entry, std::string_view text,
                                 const Range& range) const {
    const double value = message_.number(text, entry.at);
    if (!range.holds(value)) {
      message_.refuse(entry.at, fmt::format("{} {}", key, is_outside(value, range)), std::string(range.why));
    }
    return value;
  }
  [[nodiscard]] double number(std::string_view key, const Range& range) {
    const NdmEntry& entry = needed(key);
    return number_of(key, entry, entry.value, range);
  }

  [[nodiscard]] std::size_t count(std::string_view key, int most, int least = 1) {
    const NdmEntry& entry = needed(key);
    const double value = message_.number(entry.value, entry.at);
    if (!(value >= least && value <= most) || value != std::floor(value)) {
      message_.refuse(entry.at, fmt::format("{} is {}", key, in_quotes(entry.value)),
                      fmt::format("it is a whole number from {} to {}", least, most));
    }
    return static_cast<std::size_t>(value);
  }

  [[nodiscard]] Estimator estimator() {
    const NdmEntry& entry = needed("ESTIMATOR");
    const std::optional<Estimator> found = estimator_named(entry.value);
    if (!found) {
      message_.refuse(entry.at, fmt::format("ESTIMATOR is {}", in_quotes(entry.value)),
                      fmt::format("give one of: {}", estimator_choices()));
    }
    return *found;
  }

  void take_verdict() {
    const NdmEntry& entry = needed("VERDICT");
    if (entry.value != "TRUSTWORTHY" && entry.value != "DO NOT USE") {
      message_.refuse(entry.at, fmt::format("VERDICT is {}", in_quotes(entry.value)), "give TRUSTWORTHY or DO NOT USE");
    }
    Verdict& verdict = calibration().verdict;
    verdict.trustworthy = entry.value == "TRUSTWORTHY";
    const NdmEntry* findings = optional("FINDINGS");
    const NdmEntry* severities = optional("SEVERITIES");
    if (findings == nullptr) {
      return;
    }
    const std::vector<std::string_view> codes = words_of(findings->value);
    const std::vector<std::string_view> told =
        severities != nullptr ? words_of(severities->value) : std::vector<std::string_view>{};
    if (severities != nullptr && told.size() != codes.size()) {
      message_.refuse(severities->at, fmt::format("SEVERITIES has {} words, FINDINGS {}", told.size(), codes.size()),
                      "give one for each finding");
    }
    for (std::size_t i = 0; i < codes.size(); ++i) {
      Finding finding;
      finding.code = finding_code_named(codes[i]);
      finding.text = fmt::format("The message has the finding {}, without its text.", codes[i]);
      finding.severity = row_of(finding.code).severity;
      if (severities != nullptr) {
        const auto* const row = std::ranges::find(kFindingSeverities, told[i], &FindingSeverityRow::name);
        if (row == kFindingSeverities.end()) {
          message_.refuse(severities->at, fmt::format("the severity {} is not known", in_quotes(told[i])),
                          "give note, warning or do-not-use");
        }
        finding.severity = row->severity;
      }
      verdict.findings.push_back(std::move(finding));
    }
  }

  /// The 1-sigma of a parameter, if the message has it, as a row of the diagonal.
  void take_sigma(const std::string& key, const ParameterId& parameter, const Range& range) {
    if (optional(key) != nullptr) {
      calibration().states.push_back(parameter);
      sigma_.push_back(number(key, range));
    }
  }

  DriftModelId drift_model(const std::string& key) {
    const NdmEntry& model = needed(key);
    const std::optional<DriftModelId> found = drift_model_named(model.value);
    if (!found) {
      message_.refuse(model.at, fmt::format("{} is {}, no drift model", key, in_quotes(model.value)),
                      fmt::format("give {}", drift_model_choices()));
    }
    return *found;
  }

  void take_gyro(std::size_t k) {
    GyroCalibration& gyro = calibration().gyros.emplace_back();
    const std::string owner = fmt::format("GYRO{}_", k + 1);
    gyro.drift_model = drift_model(owner + "DRIFT_MODEL");
    Range drift_sigma = limits::kDriftSigma_rad_s;
    Range alignment_sigma = limits::kAlignmentSigma_rad;
    drift_sigma.least = alignment_sigma.least = 0;  // as in calibration.json
    for (const DriftCoefficient& coefficient : coefficients_of(gyro.drift_model)) {
      const std::string key = owner + acm_keyword(name_of(coefficient));
      gyro.drift_rad_s.push_back(number(key + "_RAD_S", limits::kDrift_rad_s));
      take_sigma(key + "_SIGMA_RAD_S", ParameterId::drift(k, coefficient), drift_sigma);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const char letter = "XYZ"[axis];
      const std::string key = fmt::format("{}ALIGN_{}", owner, letter);
      gyro.alignment_rotation_vector_rad(axis) = number(key + "_RAD", limits::kRotation_rad);
      take_sigma(key + "_SIGMA_RAD", ParameterId::alignment(k, axis), alignment_sigma);
      gyro.momentum_in(axis) =
          number(fmt::format("{}MOMENTUM_IN_{}", owner, letter), {-1, 1, "", "it is a unit vector"});
      if (const std::string bias = fmt::format("{}COSINE_BIAS_{}", owner, letter); optional(bias) != nullptr) {
        gyro.readout_bias(axis) = number(bias, limits::kReadoutBias);
      }
    }
    if (const std::string period = owner + "POLHODE_PERIOD_S"; optional(period) != nullptr) {
      const double period_s = number(period, limits::kPolhodePeriod_s);
      const double rate = number(owner + "POLHODE_PERIOD_RATE", limits::kPolhodePeriodRate);
      gyro.polhode = PolhodeDrift{{static_cast<float>(period_s), static_cast<float>(rate)}, calibration().epoch};
    }
    if (!(std::abs(gyro.momentum_in.norm() - 1) <= 1e-6)) {
      message_.refuse(needed(owner + "MOMENTUM_IN_X").at, fmt::format("{}MOMENTUM_IN is not a unit vector", owner),
                      "repair its components");
    }
  }

  void take_clocks() {
    const bool is_there = optional("CLOCKS_OFFSET_S") != nullptr;
    if (!is_there) {
      return;
    }
    ClockCorrection& clocks = calibration().clocks.emplace();
    clocks.offset_s = number("CLOCKS_OFFSET_S", limits::kClockOffset_s);
    clocks.rate_s_s = number("CLOCKS_RATE_S_S", limits::kClockRate_s_s);
    for (std::size_t k = 0; k < calibration().gyros.size(); ++k) {
      clocks.late_s[static_cast<int>(k)] = number(fmt::format("GYRO{}_LATE_S", k + 1), limits::kLatency_s);
    }
  }

  void take_noise() {
    if (optional("NOISE_DIRECTION_RANDOM_WALK_RAD_SQRT_S") == nullptr) {
      return;
    }
    const auto zero_allowed = [](Range range) {
      range.zero_allowed = true;
      return range;
    };
    CalibrationNoise& noise = calibration().noise.emplace();
    noise.direction_random_walk_rad_sqrt_s =
        number("NOISE_DIRECTION_RANDOM_WALK_RAD_SQRT_S", limits::kRandomWalk_rad_sqrt_s);
    noise.wandering_drift_rad_s = number("NOISE_WANDERING_DRIFT_RAD_S", zero_allowed(limits::kWanderingDrift_rad_s));
    noise.wandering_time_s =
        number("NOISE_WANDERING_TIME_S",
               noise.wandering_drift_rad_s > 0 ? limits::kWanderingTime_s : zero_allowed(limits::kWanderingTime_s));
    if (const NdmEntry* found = optional("NOISE_STAR_TRACKER_RAD")) {
      const std::vector<std::string_view> words = words_of(found->value);
      if (words.size() != 3) {
        message_.refuse(found->at, fmt::format("NOISE_STAR_TRACKER_RAD has {} values", words.size()),
                        "give those about c x, y and z");
      }
      Eigen::Vector3d& level = noise.star_tracker_noise_rad.emplace();
      for (std::size_t i = 0; i < 3; ++i) {
        level(static_cast<Eigen::Index>(i)) =
            number_of("NOISE_STAR_TRACKER_RAD", *found, words[i], limits::kStarTrackerNoise_rad);
      }
    }
  }

  void take_field() {
    using Member = DriftCoefficient::Member;
    std::vector<std::pair<Position, DriftFieldLevel>> levels;
    for (int gyro = 0; gyro < static_cast<int>(calibration().gyros.size()); ++gyro) {
      for (const Member potential : {Member::kW, Member::kD}) {
        for (int degree = 1; degree <= DriftModelId::kMaxDegree; ++degree) {
          const std::string owner = acm_field_level(gyro, potential, degree);
          if (const NdmEntry* rms = optional(owner + "_RMS_RAD_S")) {
            levels.emplace_back(rms->at, DriftFieldLevel{gyro, potential, degree,
                                                         number(owner + "_RMS_RAD_S", limits::kDriftField_rad_s),
                                                         number(owner + "_SIGMA_FACTOR", limits::kSigmaFactor)});
          }
        }
      }
    }
    std::ranges::sort(levels, {}, [](const auto& level) { return std::pair(level.first.line, level.first.column); });
    for (const auto& [at, level] : levels) {
      calibration().drift_field.push_back(level);
    }
    if (const NdmEntry* model = optional("ON_BOARD_DRIFT_MODEL")) {
      OnBoardDrift& on_board = calibration().on_board_drift.emplace();
      on_board.drift_model = drift_model("ON_BOARD_DRIFT_MODEL");
      if (on_board.drift_model.degree > DriftModelId::kMaxDegreeOnBoard) {
        message_.refuse(model->at, fmt::format("ON_BOARD_DRIFT_MODEL is {}", in_quotes(model->value)),
                        fmt::format("there is room for degree {} and less", DriftModelId::kMaxDegreeOnBoard));
      }
      on_board.random_walk_rad_sqrt_s = number("ON_BOARD_RANDOM_WALK_RAD_SQRT_S", limits::kRandomWalk_rad_sqrt_s);
    }
  }

  /// What a pass says of its sensors is no part of a calibration.
  void ignore_sensors() {
    constexpr std::size_t kMostHeads = 256;
    static_cast<void>(optional("STAR_TRACKERS"));
    for (std::size_t head = 1; head <= kMostHeads; ++head) {
      static_cast<void>(optional(fmt::format("STAR_TRACKER{}_NOISE_RAD", head)));
    }
    for (std::size_t k = 1; k <= calibration().gyros.size(); ++k) {
      static_cast<void>(optional(fmt::format("GYRO{}_READOUT_NOISE_RAD", k)));
    }
    static_cast<void>(optional("COVARIANCE_FILE"));
  }

  /// Statistics and further states by their names. A keyword of ours that is none of them is refused, whereas those of
  /// others are read over.
  void take_rest() {
    std::vector<std::pair<Position, FurtherEstimate>> further;
    for (const auto& [whole, entry] : user_->entries) {
      if (!whole.starts_with(kAcmPrefix) || asked_.contains(whole)) {
        continue;
      }
      const std::string key = whole.substr(kAcmPrefix.size());
      std::string name = key;
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (key.starts_with(kAcmStatistic)) {
        set_value(calibration().statistics, name.substr(kAcmStatistic.size()), number(key, {}));
        continue;
      }
      constexpr std::string_view kSigma = "_SIGMA";
      const bool is_sigma = key.ends_with(kSigma);
      const std::string stem = is_sigma ? key.substr(0, key.size() - kSigma.size()) : key;
      const std::optional<ParameterId> parameter = parameter_named(name.substr(0, stem.size()));
      if (!parameter || parameter->kind != ParameterId::Kind::kFurtherState ||
          (name.starts_with("gyro") && parameter->owner >= calibration().gyros.size())) {
        refuse_unknown(key, entry);
      }
      const double value = number(stem, limits::kFurtherState);
      const double sigma = number(stem + std::string(kSigma), limits::kFurtherStateSigma);
      further.emplace_back(entry.at, FurtherEstimate{*parameter, value, sigma});
    }
    std::ranges::sort(further, {}, [](const auto& one) { return std::pair(one.first.line, one.first.column); });
    for (const auto& [at, estimate] : further) {
      calibration().further.push_back(estimate);
      const int component = estimate.parameter.component;
      if (estimate.parameter.is_further(FurtherState::kPolhode)) {
        std::optional<PolhodeDrift>& drift = calibration().gyros[estimate.parameter.owner].polhode;
        if (!drift) {
          message_.refuse(at, "there are coefficients that come and go with a polhode, and no POLHODE_PERIOD_S",
                          "give one that export --format acm wrote");
        }
        (component < Layout::kEq1 ? drift->sine_rad_s : drift->cosine_rad_s)(component % Layout::kEq1) = estimate.value;
      }
      if (!estimate.parameter.is_further(FurtherState::kOrbitalDrift)) {
        continue;
      }
      std::optional<OrbitalDrift>& drift = calibration().gyros[estimate.parameter.owner].orbital_drift;
      if (!drift) {
        message_.refuse(at, "there is drift at orbital period, and no ORBITAL_RATE_RAD_S",
                        "give one that export --format acm wrote");
      }
      (component < 3 ? drift->sine_rad_s : drift->cosine_rad_s)(component % 3) = estimate.value;
    }
  }

  [[noreturn]] void refuse_unknown(const std::string& key, const NdmEntry& entry) const {
    for (std::size_t k = 0; k < calibration_gyros(); ++k) {
      const std::string owner = fmt::format("GYRO{}_", k + 1);
      for (const DriftCoefficient& coefficient : coefficients_of(kLargestDriftModel)) {
        const std::string name = owner + acm_keyword(name_of(coefficient));
        if (key == name + "_RAD_S" || key == name + "_SIGMA_RAD_S") {
          message_.refuse(entry.at,
                          fmt::format("{} is not a coefficient of the drift model {} of gyro {}", name_of(coefficient),
                                      name_of(result_.calibration.gyros[k].drift_model), k + 1),
                          "correct the model, or remove the keyword");
        }
      }
    }
    std::vector<std::string_view> known;
    for (const std::string& name : asked_) {
      known.push_back(std::string_view(name).substr(kAcmPrefix.size()));
    }
    message_.refuse(entry.at, fmt::format("{} is no keyword of a calibration", in_quotes(key)), suggestion(key, known));
  }
  [[nodiscard]] std::size_t calibration_gyros() const { return result_.calibration.gyros.size(); }

  void take_covariance() {
    const auto n = static_cast<Eigen::Index>(sigma_.size());
    const Eigen::VectorXd sigma = Eigen::Map<const Eigen::VectorXd>(sigma_.data(), n);
    calibration().covariance = sigma.array().square().matrix().asDiagonal();
    const NdmEntry* named = optional("COVARIANCE_FILE");
    if (named == nullptr) {
      return;
    }
    const std::filesystem::path name(named->value);
    if (name.has_parent_path() || name.filename() != name || name == ".." || name == ".") {
      message_.refuse(named->at, fmt::format("COVARIANCE_FILE is {}", in_quotes(named->value)),
                      "give the name of a file beside the message, without a directory");
    }
    result_.covariance_file = file_.parent_path() / name;
    std::error_code ignored;
    if (!std::filesystem::exists(result_.covariance_file, ignored)) {
      return;
    }
    read_covariance(result_.covariance_file);
    result_.has_full_covariance = true;
  }

  void read_covariance(const std::filesystem::path& path) {
    const NetcdfInput input(path);
    const std::optional<std::string> told = input.text_attributes("", {kCovarianceStates}).front();
    if (!told) {
      throw InputRefused(path, {}, fmt::format("has no attribute {}", kCovarianceStates),
                         "export the calibration again");
    }
    const std::vector<ParameterId> of_message = calibration().states;
    std::vector<std::size_t> at_message;
    std::vector<ParameterId> states;
    std::vector<std::string> columns;
    for (const std::string_view word : words_of(*told)) {
      const std::optional<ParameterId> parameter = parameter_named(word);
      const auto found = parameter ? std::ranges::find(of_message, *parameter) : of_message.end();
      if (found == of_message.end() || std::ranges::find(states, *parameter) != states.end()) {
        throw InputRefused(path, {},
                           fmt::format("has the state {}, {}", in_quotes(word),
                                       found == of_message.end() ? "whose sigma the message does not have" : "twice"),
                           "give the file that was exported with the message, or remove it");
      }
      at_message.push_back(static_cast<std::size_t>(found - of_message.begin()));
      states.push_back(*parameter);
      columns.push_back(fmt::format("covariance[{}]", columns.size()));
    }
    if (states.size() != of_message.size()) {
      throw InputRefused(path, {}, fmt::format("has {} states, the message {}", states.size(), of_message.size()),
                         "give the file that was exported with the message, or remove it");
    }
    if (states.empty()) {
      return;
    }
    const std::vector<std::vector<double>> values = input.read_variables(columns);
    const auto n = static_cast<Eigen::Index>(states.size());
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const std::vector<double>& column = values[static_cast<std::size_t>(j)];
      if (column.size() != states.size()) {
        throw InputRefused(path, {}, fmt::format("has {} rows for {} states", column.size(), n),
                           "export the calibration again");
      }
      covariance.col(j) = Eigen::Map<const Eigen::VectorXd>(column.data(), n);
    }
    // The message has 16 digits.
    constexpr double kDigits = 1e-14;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double sigma = sigma_[at_message[static_cast<std::size_t>(i)]];
      if (!(std::abs(std::sqrt(covariance(i, i)) - sigma) <= kDigits * sigma)) {
        throw InputRefused(
            path, {},
            fmt::format("has another sigma of {} than the message: {:.6g} instead of {:.6g}",
                        name_of(states[static_cast<std::size_t>(i)]), std::sqrt(covariance(i, i)), sigma),
            "give the file that was exported with the message, or remove it");
      }
    }
    if (!covariance.allFinite()) {
      throw InputRefused(path, {}, "has a covariance that is no number", "export the calibration again");
    }
    calibration().states = states;
    calibration().covariance = covariance;
  }

  const std::filesystem::path& file_;
  NdmMessage message_;
  TimeText clock_;
  CalibrationMessage result_;
  const NdmBlock* user_ = nullptr;
  std::set<std::string, std::less<>> asked_;
  std::vector<double> sigma_;  ///< of the states, as the message has them
};

}  // namespace

bool is_calibration_message(std::string_view text) { return ndm_kind(text) == "ACM"; }

CalibrationMessage parse_calibration_message(std::string_view text, const std::filesystem::path& file) {
  return AcmReader(text, file).read();
}

std::variant<AttitudeMessage, CalibrationMessage> read_message(const std::filesystem::path& file) {
  const TextFile content(file);
  if (is_c_kernel(content.text())) {
    return read_c_kernel(content.text(), file);
  }
  if (is_calibration_message(content.text())) {
    return parse_calibration_message(content.text(), file);
  }
  if (!is_attitude_message(content.text())) {
    refuse_other_than_text(content.text(), file);
    throw InputRefused(file, {}, "is nothing that can be imported",
                       "give a telemetry.toml, a pass, or a message: AEM, APM or ACM as text (CCSDS_AEM_VERS in its "
                       "first line) or XML, or a C-kernel of SPICE");
  }
  return parse_attitude_message(content.text(), file);
}

}  // namespace trihedron::io
