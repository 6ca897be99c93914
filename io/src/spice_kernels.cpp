#include "trihedron/io/spice_kernels.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>

#include "trihedron/core/frames.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

static_assert(std::endian::native == std::endian::little, "kernels are written as they lie in memory");

// ---- DAF: NAIF's daf.req. Records of 1024 bytes, addresses of doubles counted from 1.

constexpr std::size_t kRecord = 1024;
constexpr std::size_t kWordsPerRecord = kRecord / sizeof(double);
constexpr std::int32_t kDoublesPerSummary = 2;
constexpr std::int32_t kIntegersPerSummary = 6;
constexpr std::int32_t kSummaryRecord = 2;
constexpr std::size_t kFirstDataRecord = 4;
constexpr std::size_t kNameLength = std::size_t{8} * (kDoublesPerSummary + (kIntegersPerSummary + 1) / 2);
constexpr std::int32_t kJ2000 = 1;  // SPICE's number of the frame
constexpr std::int32_t kCkType = 3;

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(&bytes[at], &value, sizeof value);
}

void put_text(std::string& bytes, std::size_t at, std::string_view text, std::size_t length) {
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length, ' ');
  std::copy_n(text.begin(), std::min(text.size(), length), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

/// A DAF/CK with one array.
std::string daf_of(const std::vector<double>& data, double begin, double end, std::int32_t frame_id,
                   std::string_view name) {
  const std::size_t records = kFirstDataRecord - 1 + (data.size() + kWordsPerRecord - 1) / kWordsPerRecord;
  const std::size_t first = (kFirstDataRecord - 1) * kWordsPerRecord + 1;
  const std::size_t last = first + data.size() - 1;
  std::string bytes(records * kRecord, '\0');
  // The file record.
  put_text(bytes, 0, "DAF/CK", 8);
  put(bytes, 8, kDoublesPerSummary);
  put(bytes, 12, kIntegersPerSummary);
  put_text(bytes, 16, name, 60);
  put(bytes, 76, kSummaryRecord);
  put(bytes, 80, kSummaryRecord);
  put(bytes, 84, static_cast<std::int32_t>(last + 1));
  put_text(bytes, 88, "LTL-IEEE", 8);
  // Bytes that a transfer as text would change.
  constexpr std::string_view kValidation("FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xCE:ENDFTP", 28);
  put_text(bytes, 699, kValidation, kValidation.size());
  // The summary record: next, previous, number of summaries; then the one.
  put(bytes, kRecord + 16, 1.0);
  put(bytes, kRecord + 24, begin);
  put(bytes, kRecord + 32, end);
  const std::int32_t integers[] = {
      frame_id, kJ2000, kCkType, 1, static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)};
  std::memcpy(&bytes[kRecord + 40], integers, sizeof integers);
  // Its name.
  put_text(bytes, 2 * kRecord, name, kRecord);
  put_text(bytes, 2 * kRecord, name, kNameLength);
  std::memcpy(&bytes[(kFirstDataRecord - 1) * kRecord], data.data(), data.size() * sizeof(double));
  return bytes;
}

/// Every hundredth, as directories of a CK have them.
void add_directory(std::vector<double>& data, const std::vector<double>& values) {
  for (std::size_t i = 100; i < values.size(); i += 100) {
    data.push_back(values[i - 1]);
  }
}

// ---- Text kernels

constexpr std::size_t kLongestFrameName = 26;

std::string kernel_name(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    result.push_back(std::isalnum(byte) != 0 || c == '-' ? static_cast<char>(std::toupper(byte)) : '_');
  }
  return result;
}

/// In quotation marks, those within doubled.
std::string kernel_text(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    result += c == '\'' ? "''" : std::string(1, c);
  }
  return result + "'";
}

/// A vector, one value in a line.
template <class Values, class Shown>
std::string variable(const std::string& name, const Values& values, const Shown& shown) {
  std::string text = fmt::format("   {} = (", name);
  for (const auto& value : values) {
    text += fmt::format("\n      {}", shown(value));
  }
  return text + " )\n";
}

std::string numbers(const std::string& name, const std::vector<double>& values) {
  return variable(name, values, [](double value) { return fmt::format("{:.16e}", value); });
}

std::string words(const std::string& name, const std::vector<std::string>& values) {
  return variable(name, values, [](const std::string& value) { return kernel_text(value); });
}

/// The spacecraft's name and number, and frame c.
std::string body_frame(const SpiceObject& object) {
  const int id = object.frame_id();
  const std::string name = object.frame_name();
  return fmt::format(
      "   NAIF_BODY_NAME += ( {0} )\n   NAIF_BODY_CODE += ( {1} )\n\n"
      "   FRAME_{2} = {3}\n   FRAME_{3}_NAME = '{2}'\n   FRAME_{3}_CLASS = 3\n   FRAME_{3}_CLASS_ID = {3}\n"
      "   FRAME_{3}_CENTER = {1}\n   CK_{3}_SCLK = {1}\n   CK_{3}_SPK = {1}\n",
      kernel_text(kernel_name(object.name)), object.naif_id, name, id);
}

}  // namespace

std::string SpiceObject::frame_name() const { return kernel_name(name).substr(0, kLongestFrameName - 2) + "_C"; }

std::string SpiceObject::gyro_frame_name(std::size_t gyro) const {
  const std::string end = fmt::format("_GYRO{}", gyro + 1);
  return kernel_name(name).substr(0, kLongestFrameName - end.size()) + end;
}

void expect_spice_object(const SpiceObject& object) {
  if (object.naif_id > kFirstNaifId || object.naif_id < kLastNaifId) {
    throw UsageError(fmt::format("--naif-id {}: give the number of the spacecraft in SPICE, {} to {}", object.naif_id,
                                 kLastNaifId, kFirstNaifId));
  }
  const bool plain = std::ranges::all_of(object.name, [](char c) { return c >= ' ' && c <= '~'; });
  if (object.name.empty() || std::isalpha(static_cast<unsigned char>(object.name.front())) == 0 || !plain) {
    throw UsageError(
        fmt::format("the name of the spacecraft, {}: give one in ASCII that begins with a letter, by "
                    "--object-name",
                    in_quotes(object.name)));
  }
}

SpiceClock SpiceClock::of(const AttitudeHistory& attitude) {
  using std::chrono::seconds;
  constexpr Duration kTtMinusTai = std::chrono::milliseconds(32184);
  const Time j2000 = parse_epoch("2000-01-01T12:00:00").value();
  const seconds whole = std::chrono::floor<seconds>(attitude.t.front() + kTtMinusTai - j2000);
  const SpiceClock clock{whole.count(), j2000 + whole - kTtMinusTai};
  constexpr Duration kLongest{std::int64_t{1} << 53};
  if (attitude.t.back() - clock.zero >= kLongest) {
    throw UsageError("the attitude spans more than 104 days, which a clock of nanoseconds does not count; split it");
  }
  return clock;
}

double SpiceClock::ticks(Time t) const { return static_cast<double>((t - zero).count()); }

std::vector<Eigen::Vector3d> rates_of(const AttitudeHistory& attitude, std::span<const Eigen::Vector3d> given,
                                      std::span<const std::size_t> stretches) {
  std::vector<Eigen::Vector3d> rates(given.begin(), given.end());
  if (!rates.empty()) {
    return rates;
  }
  rates.assign(attitude.size(), Eigen::Vector3d::Zero());
  // The constant rate that leads from one epoch to the next; it is the same in the axes c of both.
  const auto between = [&](std::size_t i) {
    Eigen::Quaterniond turn = (attitude.q_in_c[i].conjugate() * attitude.q_in_c[i + 1]).normalized();
    if (turn.w() < 0) {
      turn.coeffs() = -turn.coeffs();
    }
    const double sine = turn.vec().norm();
    const double factor = sine < 1e-9 ? 2 : 2 * std::atan2(sine, turn.w()) / sine;
    return Eigen::Vector3d(turn.vec() * (factor / to_seconds(attitude.t[i + 1] - attitude.t[i])));
  };
  for (std::size_t s = 0; s + 1 < stretches.size(); ++s) {
    const std::size_t begin = stretches[s];
    const std::size_t end = stretches[s + 1];
    for (std::size_t i = begin; i < end && end - begin > 1; ++i) {
      check_stop();
      if (i == begin) {
        rates[i] = between(i);
      } else if (i + 1 == end) {
        rates[i] = between(i - 1);
      } else {
        // Weighted so that the derivative of a parabola through the three is met.
        const double before_s = to_seconds(attitude.t[i] - attitude.t[i - 1]);
        const double after_s = to_seconds(attitude.t[i + 1] - attitude.t[i]);
        rates[i] = (between(i - 1) * after_s + between(i) * before_s) / (before_s + after_s);
      }
    }
  }
  return rates;
}

std::string format_ck(const AttitudeHistory& attitude, std::span<const Eigen::Vector3d> rate_rad_s,
                      const SpiceClock& clock, const SpiceObject& object, std::span<const std::size_t> stretches) {
  constexpr std::size_t kPerEpoch = 7;
  const std::vector<Eigen::Vector3d> rates = rates_of(attitude, rate_rad_s, stretches);
  std::vector<double> data;
  std::vector<double> ticks;
  data.reserve(attitude.size() * (kPerEpoch + 2));
  ticks.reserve(attitude.size());
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    check_stop();
    const Eigen::Quaterniond q = attitude.q_in_c[i].normalized();
    const Eigen::Vector3d rate_in = q * rates[i];
    data.insert(data.end(), {q.w(), -q.x(), -q.y(), -q.z(), rate_in.x(), rate_in.y(), rate_in.z()});
    ticks.push_back(clock.ticks(attitude.t[i]));
  }
  data.insert(data.end(), ticks.begin(), ticks.end());
  add_directory(data, ticks);
  std::vector<double> starts;
  for (std::size_t s = 0; s + 1 < stretches.size(); ++s) {
    starts.push_back(ticks[stretches[s]]);
  }
  data.insert(data.end(), starts.begin(), starts.end());
  add_directory(data, starts);
  data.push_back(static_cast<double>(starts.size()));
  data.push_back(static_cast<double>(ticks.size()));
  return daf_of(data, ticks.front(), ticks.back(), object.frame_id(), object.frame_name());
}

std::string format_sclk(const SpiceClock& clock, const SpiceObject& object) {
  const int suffix = -object.naif_id;
  return fmt::format(
      "KPL/SCLK\n\n"
      "Clock of the attitude of {0}: seconds and nanoseconds since {1} TAI. It is no clock on board.\n"
      "Its ticks are nanoseconds of TT, uniform with TAI.\n\n"
      "\\begindata\n\n"
      "   SCLK_DATA_TYPE_{2} = ( 1 )\n"
      "   SCLK01_TIME_SYSTEM_{2} = ( 2 )\n"
      "   SCLK01_N_FIELDS_{2} = ( 2 )\n"
      "   SCLK01_MODULI_{2} = ( 9007199 1000000000 )\n"
      "   SCLK01_OFFSETS_{2} = ( 0 0 )\n"
      "   SCLK01_OUTPUT_DELIM_{2} = ( 1 )\n"
      "   SCLK_PARTITION_START_{2} = ( 0.0E+00 )\n"
      "   SCLK_PARTITION_END_{2} = ( 9.007199E+15 )\n"
      "   SCLK01_COEFFICIENTS_{2} = ( 0.0E+00 {3}.0 1.0E+00 )\n\n"
      "\\begintext\n",
      kernel_name(object.name), format_epoch(clock.zero), suffix, clock.tt_since_j2000_s);
}

std::string format_ck_frames(const SpiceObject& object) {
  return fmt::format(
      "KPL/FK\n\n"
      "Frame {}: the axes c of the star tracker, x roll, y pitch, z heading, by the C-kernel.\n\n"
      "\\begindata\n\n{}\n\\begintext\n",
      object.frame_name(), body_frame(object));
}

std::string format_calibration_frames(const Calibration& calibration, const SpiceObject& object) {
  std::string text = fmt::format(
      "KPL/FK\n\n"
      "Calibration of the gyros of {0}, at {1} TAI by estimator {2}.\n\n"
      "{3}: the axes c of the star tracker.\n"
      "The frames of the gyros are their case axes: TK frames relative to c, whose matrix is C_c_b, column by column.\n"
      "Drift coefficients in rad/s, alignments in rad, as in calibration.json; sigmas are 1-sigma.\n"
      "The variable INS{4}_TRUSTWORTHY is 1 where the verdict is trustworthy, 0 where it is \"do not use\".\n\n"
      "\\begindata\n\n{5}\n",
      kernel_name(object.name), format_epoch(calibration.t), name_of(calibration.estimator), object.frame_name(),
      object.naif_id, body_frame(object));
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    const GyroCalibration& gyro = calibration.gyros[k];
    const int id = object.frame_id() - static_cast<int>(k) - 1;
    const Eigen::Matrix3d c_c_b = Rot<C, C>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
    text += fmt::format(
        "   FRAME_{0} = {1}\n   FRAME_{1}_NAME = '{0}'\n   FRAME_{1}_CLASS = 4\n   FRAME_{1}_CLASS_ID = {1}\n"
        "   FRAME_{1}_CENTER = {2}\n   TKFRAME_{1}_RELATIVE = '{3}'\n   TKFRAME_{1}_SPEC = 'MATRIX'\n",
        object.gyro_frame_name(k), id, object.naif_id, object.frame_name());
    text += numbers(fmt::format("TKFRAME_{}_MATRIX", id), {c_c_b.data(), c_c_b.data() + c_c_b.size()});
    std::vector<std::string> names;
    std::vector<double> sigmas;
    std::vector<double> alignment_sigmas;
    const std::vector<DriftCoefficient> coefficients = coefficients_of(gyro.drift_model);
    for (const DriftCoefficient& coefficient : coefficients) {
      names.push_back(name_of(coefficient));
      sigmas.push_back(sigma_of(calibration, ParameterId::drift(k, coefficient)));
    }
    for (int axis = 0; axis < 3; ++axis) {
      alignment_sigmas.push_back(sigma_of(calibration, ParameterId::alignment(k, axis)));
    }
    const auto three = [](const Eigen::Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
    text += words(fmt::format("INS{}_DRIFT_MODEL", id), {name_of(gyro.drift_model)});
    text += words(fmt::format("INS{}_DRIFT_NAMES", id), names);
    text += numbers(fmt::format("INS{}_DRIFT_RAD_S", id), gyro.drift_rad_s);
    if (std::ranges::all_of(sigmas, [](double s) { return std::isfinite(s); })) {
      text += numbers(fmt::format("INS{}_DRIFT_SIGMA_RAD_S", id), sigmas);
    }
    text += numbers(fmt::format("INS{}_ALIGN_ROTVEC_RAD", id), three(gyro.alignment_rotation_vector_rad));
    if (std::ranges::all_of(alignment_sigmas, [](double s) { return std::isfinite(s); })) {
      text += numbers(fmt::format("INS{}_ALIGN_SIGMA_RAD", id), alignment_sigmas);
    }
    text += numbers(fmt::format("INS{}_MOMENTUM_IN", id), three(gyro.momentum_in)) + "\n";
  }
  text += words(fmt::format("INS{}_ESTIMATOR", object.naif_id), {std::string(name_of(calibration.estimator))});
  text += words(fmt::format("INS{}_EPOCH_TAI", object.naif_id), {format_epoch(calibration.t)});
  text += fmt::format("   INS{}_TRUSTWORTHY = {}\n\n\\begintext\n", object.naif_id,
                      calibration.verdict.trustworthy ? 1 : 0);
  return text;
}

}  // namespace trihedron::io
