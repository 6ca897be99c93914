#include "aem_builder.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "attitude_rules.hpp"
#include "ccsds_frames.hpp"
#include "ndm_text.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::array<std::string_view, 4> kHeader = {"CLASSIFICATION", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID"};
constexpr std::array<std::string_view, 15> kMetadata = {
    "OBJECT_NAME",   "OBJECT_ID",     "CENTER_NAME",        "REF_FRAME_A",          "REF_FRAME_B",
    "TIME_SYSTEM",   "START_TIME",    "USEABLE_START_TIME", "USEABLE_STOP_TIME",    "STOP_TIME",
    "ATTITUDE_TYPE", "EULER_ROT_SEQ", "ANGVEL_FRAME",       "INTERPOLATION_METHOD", "INTERPOLATION_DEGREE"};
constexpr std::array<std::string_view, 17> kMetadata1 = {
    "OBJECT_NAME",         "OBJECT_ID",         "CENTER_NAME", "REF_FRAME_A",
    "REF_FRAME_B",         "ATTITUDE_DIR",      "TIME_SYSTEM", "START_TIME",
    "USEABLE_START_TIME",  "USEABLE_STOP_TIME", "STOP_TIME",   "ATTITUDE_TYPE",
    "QUATERNION_TYPE",     "EULER_ROT_SEQ",     "RATE_FRAME",  "INTERPOLATION_METHOD",
    "INTERPOLATION_DEGREE"};

}  // namespace

AemBuilder::AemBuilder(std::filesystem::path file, AemField version, std::string_view syntax)
    : file_(std::move(file)), version_(version.text == "1.0" ? 1 : 2) {
  if (version.text != "1.0" && version.text != "2.0") {
    refuse(version.at, fmt::format("version {} of the AEM is not known", in_quotes(version.text)),
           "give a message of version 1.0 or 2.0");
  }
  message_.format = fmt::format("CCSDS AEM version {}, {}", version_, syntax);
}

void AemBuilder::refuse(Position at, std::string reason, std::string cure) const {
  throw InputRefused(file_, at, std::move(reason), std::move(cure));
}

void AemBuilder::comment(std::string_view text) {
  if (!message_.epoch) {
    message_.epoch = epoch_in_comment(text);
  }
}

void AemBuilder::take_entry(Entries& entries, AemField key, AemField value, std::span<const std::string_view> known,
                            std::string_view section) const {
  if (std::ranges::find(known, key.text) == known.end()) {
    refuse(key.at,
           fmt::format("{} is no keyword of the {} of an AEM version {}", in_quotes(key.text), section, version_),
           suggestion(key.text, known));
  }
  if (value.text.empty()) {
    refuse(key.at, fmt::format("{} has no value", key.text), "give one, or remove the line");
  }
  if (!entries.try_emplace(std::string(key.text), Entry{std::string(value.text), value.at}).second) {
    refuse(key.at, fmt::format("{} is there twice", key.text), "keep one");
  }
}

const AemBuilder::Entry& AemBuilder::needed(const Entries& entries, const std::string& key, Position at,
                                            std::string_view section) const {
  const auto found = entries.find(key);
  if (found == entries.end()) {
    refuse(at, fmt::format("the {} has no {}", section, key), "add it: an AEM must have it");
  }
  return found->second;
}

void AemBuilder::header(AemField key, AemField value) { take_entry(header_, key, value, kHeader, "header"); }

void AemBuilder::end_header(Position at) {
  if (header_ended_) {
    return;
  }
  header_ended_ = true;
  const Entry& created = needed(header_, "CREATION_DATE", at, "header");
  TimeText::Fault fault;
  // By its form only: it may be later than the last leap second that is known.
  std::string_view text = created.value;
  text.remove_suffix(text.ends_with('Z') ? 1 : 0);
  if (!TimeText(TimeScale::kTai).parse(text, fault)) {
    refuse(created.at, "CREATION_DATE: " + fault.reason, fault.cure);
  }
  static_cast<void>(needed(header_, "ORIGINATOR", at, "header"));
}

void AemBuilder::begin_segment(Position at) {
  end_header(at);
  metadata_.clear();
  rows_ = 0;
  used_ = 0;
}

void AemBuilder::metadata(AemField key, AemField value) {
  if (version_ == 1) {
    take_entry(metadata_, key, value, kMetadata1, "metadata");
  } else {
    take_entry(metadata_, key, value, kMetadata, "metadata");
  }
}

Time AemBuilder::time_of(std::string_view text, Position at) {
  TimeText::Fault fault;
  const std::optional<Time> time = time_.parse(text, fault);
  if (!time) {
    refuse(at, fault.reason, fault.cure);
  }
  return *time;
}

void AemBuilder::take_frames(Position at) {
  const Entry& a = needed(metadata_, "REF_FRAME_A", at, "metadata");
  const Entry& b = needed(metadata_, "REF_FRAME_B", at, "metadata");
  const std::string name_a = normalised(a.value);
  const std::string name_b = normalised(b.value);
  for (const auto& [name, entry] : {std::pair{&name_a, &a}, std::pair{&name_b, &b}}) {
    if (!is_inertial_frame(*name) && !is_spacecraft_frame(*name)) {
      refuse(entry->at,
             fmt::format("{} is neither an inertial frame nor one of the spacecraft", in_quotes(entry->value)),
             fmt::format("turn the attitude into one of {} before; frames of the spacecraft are named {}",
                         kInertialFrames, kSpacecraftFrames));
    }
  }
  a_is_body_ = is_spacecraft_frame(name_a);
  if (a_is_body_ == is_spacecraft_frame(name_b)) {
    refuse(b.at, fmt::format("both frames are {}", a_is_body_ ? "of the spacecraft" : "inertial"),
           "give the attitude of a frame of the spacecraft in an inertial one");
  }
  const std::string& inertial = a_is_body_ ? name_b : name_a;
  const std::string& body = a_is_body_ ? name_a : name_b;
  if (message_.segments > 0 && (inertial != message_.inertial_frame || body != message_.body_frame)) {
    refuse(a.at,
           fmt::format("the frames are {} and {}, those of the segment before {} and {}", in_quotes(inertial),
                       in_quotes(body), in_quotes(message_.inertial_frame), in_quotes(message_.body_frame)),
           "give each pair of frames a message of its own");
  }
  message_.inertial_frame = inertial;
  message_.body_frame = body;
  reversed_ = a_is_body_;
  if (version_ == 1) {
    const Entry& direction = needed(metadata_, "ATTITUDE_DIR", at, "metadata");
    const std::string which = normalised(direction.value);
    if (which != "A2B" && which != "B2A") {
      refuse(direction.at, fmt::format("ATTITUDE_DIR is {}", in_quotes(direction.value)), "give A2B or B2A");
    }
    reversed_ = a_is_body_ == (which == "A2B");
  }
}

void AemBuilder::take_time_span(Position at) {
  const Entry& system = needed(metadata_, "TIME_SYSTEM", at, "metadata");
  const std::optional<TimeScale> scale = time_scale_named(system.value);
  if (!scale) {
    refuse(system.at, fmt::format("the time system {} is not known", in_quotes(system.value)),
           fmt::format("give one of {}", fmt::join(kTimeScales, ", ")));
  }
  if (*scale != time_.scale()) {
    time_ = TimeText(*scale);
  }
  if (message_.segments > 0 && name_of(*scale) != message_.time_system) {
    refuse(system.at,
           fmt::format("the time system is {}, that of the segment before {}", name_of(*scale), message_.time_system),
           "give the whole message in one time system");
  }
  message_.time_system = name_of(*scale);
  const auto time = [&](const char* key) {
    const Entry& entry = needed(metadata_, key, at, "metadata");
    return time_of(entry.value, entry.at);
  };
  start_ = time("START_TIME");
  stop_ = time("STOP_TIME");
  const bool begins = metadata_.contains("USEABLE_START_TIME");
  const bool ends = metadata_.contains("USEABLE_STOP_TIME");
  useable_start_ = begins ? time("USEABLE_START_TIME") : start_;
  useable_stop_ = ends ? time("USEABLE_STOP_TIME") : stop_;
  if (stop_ < start_) {
    refuse(metadata_.find("STOP_TIME")->second.at, "STOP_TIME is before START_TIME", "correct them");
  }
  if (useable_start_ < start_ || useable_stop_ > stop_ || useable_stop_ < useable_start_) {
    refuse(metadata_.find(begins ? "USEABLE_START_TIME" : "USEABLE_STOP_TIME")->second.at,
           "the useable span does not lie within START_TIME and STOP_TIME", "correct them");
  }
}

void AemBuilder::take_type(Position at) {
  const Entry& type = needed(metadata_, "ATTITUDE_TYPE", at, "metadata");
  const std::string name = normalised(type.value);
  if (name == "QUATERNION") {
    kind_ = Kind::kQuaternion;
  } else if (name == "QUATERNION/DERIVATIVE") {
    kind_ = Kind::kDerivative;
  } else if (name == "QUATERNION/ANGVEL" && version_ == 2) {
    kind_ = Kind::kAngularVelocity;
  } else if (name == "QUATERNION/RATE" && version_ == 1) {
    kind_ = Kind::kEulerRate;
  } else {
    refuse(type.at, fmt::format("the attitude type {} is not read", in_quotes(type.value)),
           version_ == 2 ? "give QUATERNION, QUATERNION/DERIVATIVE or QUATERNION/ANGVEL"
                         : "give QUATERNION, QUATERNION/DERIVATIVE or QUATERNION/RATE");
  }
  scalar_first_ = false;
  if (version_ == 1) {
    const Entry& order = needed(metadata_, "QUATERNION_TYPE", at, "metadata");
    const std::string which = normalised(order.value);
    if (which != "FIRST" && which != "LAST") {
      refuse(order.at, fmt::format("QUATERNION_TYPE is {}", in_quotes(order.value)), "give FIRST or LAST");
    }
    scalar_first_ = which == "FIRST";
  }
  if (kind_ == Kind::kAngularVelocity) {
    const Entry& frame = needed(metadata_, "ANGVEL_FRAME", at, "metadata");
    const std::string which = normalised(frame.value);
    const std::string& a = a_is_body_ ? message_.body_frame : message_.inertial_frame;
    const std::string& b = a_is_body_ ? message_.inertial_frame : message_.body_frame;
    if (which != "REF_FRAME_A" && which != "REF_FRAME_B" && which != a && which != b) {
      refuse(frame.at, fmt::format("ANGVEL_FRAME {} is neither of the two frames", in_quotes(frame.value)),
             fmt::format("give {} or {}", a, b));
    }
    rate_in_a_ = which == "REF_FRAME_A" || which == a;
  }
}

void AemBuilder::end_metadata(Position at) {
  const std::string& name = needed(metadata_, "OBJECT_NAME", at, "metadata").value;
  const Entry& id = needed(metadata_, "OBJECT_ID", at, "metadata");
  if (message_.segments > 0 && normalised(id.value) != normalised(message_.object_id)) {
    refuse(id.at,
           fmt::format("the object is {}, that of the segment before {}", in_quotes(id.value),
                       in_quotes(message_.object_id)),
           "give each spacecraft a message of its own");
  }
  message_.object_name = name;
  message_.object_id = id.value;
  take_frames(at);
  take_time_span(at);
  take_type(at);
  ++message_.segments;
}

double AemBuilder::number(AemField field) const {
  double value = 0;
  std::string_view digits = field.text;
  digits.remove_prefix(digits.starts_with('+') && !digits.starts_with("+-") ? 1 : 0);
  const auto [end, fault] = fast_float::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (fault != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
    refuse(field.at, fmt::format("{} is not a number", in_quotes(field.text)), "repair the line");
  }
  return value;
}

Eigen::Vector3d AemBuilder::rate_of(const Eigen::Quaterniond& given, std::span<const AemField> fields) const {
  // In version 1 the direction may be the opposite of that from A to B.
  const bool from_b_to_a = reversed_ != a_is_body_;
  // v_A = q v_B q*, and dq/dt = q ω/2 with ω of B in A, B axes.
  const Eigen::Quaterniond q = from_b_to_a ? given.conjugate() : given;
  Eigen::Vector3d omega_b;
  if (kind_ == Kind::kDerivative) {
    const Eigen::Quaterniond q_dot(number(fields[8]), number(fields[5]), number(fields[6]), number(fields[7]));
    omega_b = 2 * (q.conjugate() * (from_b_to_a ? q_dot.conjugate() : q_dot)).vec();
  } else {
    omega_b = Eigen::Vector3d(number(fields[5]), number(fields[6]), number(fields[7])) / kDegreesPerRadian;
    if (rate_in_a_) {
      omega_b = q.conjugate() * omega_b;
    }
  }
  // Where A is the spacecraft's, its rate in B is the opposite, in A axes.
  return a_is_body_ ? Eigen::Vector3d(q * -omega_b) : omega_b;
}

void AemBuilder::row(std::span<const AemField> fields) {
  check_stop();
  const Position at = fields[0].at;
  const Time t = time_of(fields[0].text, at);
  if (rows_ > 0 && t <= last_) {
    refuse(at, fmt::format("the epoch {} is not later than the one before", in_quotes(fields[0].text)),
           "put the lines in order, each epoch once");
  }
  if (t < start_ || t > stop_) {
    refuse(at, fmt::format("the epoch {} lies outside START_TIME and STOP_TIME", in_quotes(fields[0].text)),
           "correct these, or remove the line");
  }
  last_ = t;
  ++rows_;
  const Eigen::Quaterniond q(number(fields[4]), number(fields[1]), number(fields[2]), number(fields[3]));
  if (!is_unit(q)) {
    refuse(fields[1].at, fmt::format("the quaternion has the norm {:.6g}, not 1", q.norm()), "repair the line");
  }
  const bool has_rate = kind_ == Kind::kDerivative || kind_ == Kind::kAngularVelocity;
  const Eigen::Vector3d rate = has_rate ? rate_of(q, fields) : Eigen::Vector3d::Zero();
  if (t < useable_start_ || t > useable_stop_) {
    ++message_.left_out;
    return;
  }
  AttitudeHistory& attitude = message_.attitude;
  if (!attitude.t.empty() && t <= attitude.t.back()) {
    if (used_ > 0 || t < attitude.t.back()) {
      refuse(at, fmt::format("the epoch {} lies in the useable span of the segment before", in_quotes(fields[0].text)),
             "let USEABLE_START_TIME of a segment follow USEABLE_STOP_TIME of the one before");
    }
    // The segment before ends where this one begins: what follows is interpolated from this one.
    attitude.t.pop_back();
    attitude.q_in_c.pop_back();
    if (!message_.rate_rad_s.empty()) {
      message_.rate_rad_s.pop_back();
    }
    ++message_.left_out;
  }
  attitude.t.push_back(t);
  attitude.q_in_c.push_back(reversed_ ? q.conjugate() : q);
  all_have_rates_ = all_have_rates_ && has_rate;
  if (all_have_rates_) {
    message_.rate_rad_s.push_back(rate);
  } else {
    message_.rate_rad_s.clear();
  }
  ++used_;
}

void AemBuilder::end_segment(Position at) const {
  if (rows_ == 0) {
    refuse(at, "the segment has no data", "add them, or remove the segment");
  }
}

AttitudeMessage AemBuilder::finish(Position at) {
  end_header(at);
  if (message_.segments == 0) {
    refuse(at, "the message has no segment", "give a message with data");
  }
  if (message_.attitude.t.empty()) {
    refuse(at, "no epoch lies in the useable span", "correct USEABLE_START_TIME and USEABLE_STOP_TIME");
  }
  return std::move(message_);
}

}  // namespace trihedron::io
