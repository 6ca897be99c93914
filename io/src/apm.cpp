#include "apm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "attitude_rules.hpp"
#include "ccsds_frames.hpp"
#include "ndm_message.hpp"
#include "ndm_text.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kApmBlocks = {{{"QUAT", "quaternionState"},
                                                                                      {"EULER", "eulerAngleState"},
                                                                                      {"ANGVEL", "angularVelocity"},
                                                                                      {"SPIN", "spin"},
                                                                                      {"INERTIA", "inertia"},
                                                                                      {"MAN", "maneuverParameters"}}};
constexpr std::array<std::string_view, 4> kApmMetadata = {"OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "TIME_SYSTEM"};
constexpr NdmKind kApm = {"APM", kApmBlocks, kApmMetadata, false};

constexpr std::array<std::string_view, 10> kOfQuaternion = {"REF_FRAME_A", "REF_FRAME_B", "Q1",     "Q2",     "Q3",
                                                            "QC",          "Q1_DOT",      "Q2_DOT", "Q3_DOT", "QC_DOT"};
constexpr std::array<std::string_view, 6> kOfRate = {"REF_FRAME_A", "REF_FRAME_B", "ANGVEL_FRAME",
                                                     "ANGVEL_X",    "ANGVEL_Y",    "ANGVEL_Z"};

void expect_known(const NdmMessage& message, const NdmBlock& block, std::span<const std::string_view> known) {
  for (const auto& [key, entry] : block.entries) {
    if (std::ranges::find(known, key) == known.end()) {
      message.refuse(entry.at, fmt::format("{} is no keyword of {} of an APM", in_quotes(key), block.name),
                     suggestion(key, known));
    }
  }
}

/// Of c in the inertial frame, c axes; `q` as the message has it.
Eigen::Vector3d rate_in_c(const NdmMessage& message, const NdmBlock& block, const Eigen::Quaterniond& q,
                          const std::pair<std::string, std::string>& frames) {
  expect_known(message, block, kOfRate);
  if (message.frames(block) != frames) {
    message.refuse(block.at, "the frames of ANGVEL are not those of QUAT", "give them in the same frames and order");
  }
  const NdmEntry& frame = message.needed(block, "ANGVEL_FRAME");
  const std::string which = normalised(frame.value);
  const bool in_a = which == "REF_FRAME_A" || which == frames.first;
  if (!in_a && which != "REF_FRAME_B" && which != frames.second) {
    message.refuse(frame.at, fmt::format("ANGVEL_FRAME {} is neither of the two frames", in_quotes(frame.value)),
                   fmt::format("give {} or {}", frames.first, frames.second));
  }
  const Eigen::Vector3d told =
      Eigen::Vector3d(message.number(block, "ANGVEL_X", "deg/s"), message.number(block, "ANGVEL_Y", "deg/s"),
                      message.number(block, "ANGVEL_Z", "deg/s")) /
      kDegreesPerRadian;
  // That of B in A; v_A = q v_B q*. Where A is the spacecraft's, its rate in B is the opposite.
  const bool a_is_body = !is_inertial_frame(frames.first);
  if (a_is_body) {
    return -(in_a ? told : Eigen::Vector3d(q * told));
  }
  return in_a ? Eigen::Vector3d(q.conjugate() * told) : told;
}

}  // namespace

AttitudeMessage parse_apm(std::string_view text, const std::filesystem::path& file) {
  const NdmMessage message(text, file, kApm);
  AttitudeMessage result;
  result.format = message.format;
  for (const NdmRow& comment : message.comments) {
    if (const std::optional<Time> epoch = epoch_in_comment(comment.text)) {
      result.epoch = epoch;
    }
  }
  result.object_name = message.needed(message.metadata, "OBJECT_NAME").value;
  result.object_id = message.needed(message.metadata, "OBJECT_ID").value;
  TimeText clock(message.time_scale());
  result.time_system = name_of(clock.scale());
  constexpr std::array<std::string_view, 1> kOutside = {"EPOCH"};
  expect_known(message, message.data, kOutside);
  const NdmEntry& epoch = message.needed(message.data, "EPOCH");
  result.attitude.t.push_back(message.time(clock, epoch.value, epoch.at));
  const NdmBlock* quaternion = message.block("QUAT");
  if (quaternion == nullptr) {
    message.refuse(message.end, "the message has no quaternion", "give it: angles and spin are not read");
  }
  expect_known(message, *quaternion, kOfQuaternion);
  const std::pair<std::string, std::string> frames = message.frames(*quaternion);
  const bool a_is_body = !is_inertial_frame(frames.first);
  result.inertial_frame = a_is_body ? frames.second : frames.first;
  result.body_frame = a_is_body ? frames.first : frames.second;
  const Eigen::Quaterniond q(message.number(*quaternion, "QC"), message.number(*quaternion, "Q1"),
                             message.number(*quaternion, "Q2"), message.number(*quaternion, "Q3"));
  if (!is_unit(q)) {
    message.refuse(message.needed(*quaternion, "Q1").at,
                   fmt::format("the quaternion has the norm {:.6g}, not 1", q.norm()), "repair it");
  }
  result.attitude.q_in_c.push_back(a_is_body ? q.conjugate() : q);
  if (const NdmBlock* rate = message.block("ANGVEL")) {
    result.rate_rad_s.push_back(rate_in_c(message, *rate, q, frames));
  }
  result.segments = 1;
  return result;
}

std::string format_apm(const AttitudeMessage& attitude, std::size_t row, Time epoch,
                       const MessageDescription& description, MessageSyntax syntax) {
  expect_writable_description(description);
  NdmText text(syntax);
  TimeText clock(description.time_scale);
  text.header("APM", fmt::format("{}{} TAI", kEpochComment, format_epoch(epoch)), description);
  text.put("\n", "<segment>\n<metadata>\n");
  text.entry("OBJECT_NAME", description.object_name);
  text.entry("OBJECT_ID", description.object_id);
  text.entry("TIME_SYSTEM", name_of(description.time_scale));
  text.put("\n", "</metadata>\n<data>\n");
  text.entry("EPOCH", clock.format(attitude.attitude.t.at(row)));
  const auto frames = [&] {
    text.entry("REF_FRAME_A", description.inertial_frame);
    text.entry("REF_FRAME_B", description.body_frame);
  };
  const Eigen::Quaterniond& q = attitude.attitude.q_in_c.at(row);
  text.put("\nQUAT_START\n", "<quaternionState>\n");
  frames();
  text.put("", "<quaternion>\n");
  for (const auto& [key, value] : {std::pair{"Q1", q.x()}, {"Q2", q.y()}, {"Q3", q.z()}, {"QC", q.w()}}) {
    text.entry(key, fmt::format("{:.15e}", value));
  }
  text.put("QUAT_STOP\n", "</quaternion>\n</quaternionState>\n");
  if (!attitude.rate_rad_s.empty()) {
    const Eigen::Vector3d rate = attitude.rate_rad_s.at(row) * kDegreesPerRadian;
    text.put("\nANGVEL_START\n", "<angularVelocity>\n");
    frames();
    text.entry("ANGVEL_FRAME", description.body_frame);
    for (const auto& [key, value] : {std::pair{"ANGVEL_X", rate.x()}, {"ANGVEL_Y", rate.y()}, {"ANGVEL_Z", rate.z()}}) {
      text.entry(key, fmt::format("{:.15e}", value), "deg/s");
    }
    text.put("ANGVEL_STOP\n", "</angularVelocity>\n");
  }
  text.put("", "</data>\n</segment>\n");
  text.end("APM");
  return text.text();
}

}  // namespace trihedron::io
