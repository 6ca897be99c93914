#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

struct Words {
  const char* name;
  const char* one;
  const char* many;
  const char* consequence;
};

Words words(Defect::Kind kind) {
  using enum Defect::Kind;
  switch (kind) {
    case kMissingTime:
      return {"missing-time", "row without a time stamp", "rows without a time stamp", "left out"};
    case kTimeOutsidePass:
      return {"time-outside-pass", "row with a time outside the pass", "rows with a time outside the pass", "left out"};
    case kRepeatedTime:
      return {"repeated-time", "row that repeats a time stamp", "rows that repeat a time stamp", "left out"};
    case kBackwardTime:
      return {"backward-time", "row out of order in time", "rows out of order in time", "left out"};
    case kLeapingTime:
      return {"leaping-time", "row whose time leaps while the readings go on",
              "rows whose times leap while the readings go on", "left out"};
    case kTruncatedLine:
      return {"truncated-line", "last line that is cut short", "last lines that are cut short", "left out"};
    case kMissingValue:
      return {"missing-value", "row with a missing value", "rows with a missing value",
              "kept for the estimator to reject"};
    case kZeroNorm:
      return {"zero-norm", "row with a zero vector", "rows with a zero vector", "kept for the estimator to reject"};
    case kWrongNorm:
      return {"wrong-norm", "row whose norm is not 1", "rows whose norm is not 1", "kept for the estimator to judge"};
    case kSignFlip:
      return {"sign-flip", "sign flip of the quaternion", "sign flips of the quaternion", "harmless"};
    case kStuckSamples:
      return {"stuck-samples", "stuck sample", "stuck samples", "kept for the estimator to judge"};
    case kSilentGyro:
      return {"silent-gyro", "stretch of silence", "stretches of silence", "kept for the estimator to reject"};
    case kOutsideRange:
      return {"outside-range", "row outside the time range", "rows outside the time range", "left out"};
    case kExcluded:
      return {"excluded", "row in an excluded interval", "rows in excluded intervals", "left out"};
    case kFlagged:
      return {"flagged", "row with a flag that is not good", "rows with a flag that is not good", "not used"};
    case kLargeSigma:
      return {"large-sigma", "fix whose sigma is too large or missing", "fixes whose sigma is too large or missing",
              "left out"};
    case kNoCovariance:
      return {"no-covariance", "fix without a covariance that can be used",
              "fixes without a covariance that can be used", "taken with the noise of the settings"};
    case kPacketDamaged:
      return {"packet-damaged", "packet whose CRC is wrong", "packets whose CRC is wrong", "left out"};
    case kPacketsMissing:
      return {"packets-missing", "packet missing by the sequence count", "packets missing by the sequence count",
              "not filled"};
    case kOtherPackets:
      return {"other-packets", "packet of something else", "packets of something else", "skipped"};
    case kTruthIncomplete:
      return {"truth-incomplete", "truth that is not whole", "truths that are not whole",
              "nothing is compared with it"};
    case kGap:
      return {"gap", "gap", "gaps", "not filled"};
  }
  return {"defect", "defect", "defects", "kept"};
}

std::string place_text(const Place& place) {
  if (place.packet > 0) {
    return fmt::format("packet {} at octet {}", place.packet, place.octet);
  }
  std::string text = place.line > 0 ? fmt::format("line {}", place.line) : fmt::format("sample {}", place.sample);
  if (std::isfinite(place.t_s)) {
    text += fmt::format(" (t_s {})", place.t_s);
  }
  return text;
}

}  // namespace

const char* name_of(Defect::Kind kind) { return words(kind).name; }

std::string Defect::text() const {
  constexpr std::size_t kShown = 3;
  const Words said = words(kind);
  std::string text = fmt::format("{}: {} {}", where, count, count == 1 ? said.one : said.many);
  if (total > Duration::zero()) {
    text += fmt::format(", {:.6g} s in total, the longest {:.6g} s", to_seconds(total), to_seconds(longest));
  }
  text += fmt::format(", {}", said.consequence);
  for (std::size_t i = 0; i < std::min(first.size(), kShown); ++i) {
    text += fmt::format("{}{}", i == 0 ? (count == 1 ? ": " : "; first: ") : ", ", place_text(first[i]));
  }
  return text + ".";
}

}  // namespace trihedron::io
