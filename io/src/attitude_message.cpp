#include "trihedron/io/attitude_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "aem_syntax.hpp"
#include "apm.hpp"
#include "attitude_rules.hpp"
#include "ccsds_frames.hpp"
#include "ndm_message.hpp"
#include "ndm_text.hpp"
#include "text_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

std::string_view without_lead(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  return text;
}

bool is_xml(std::string_view text) { return without_lead(text).starts_with('<'); }

/// Writes one AEM.
class AemWriter {
 public:
  AemWriter(const MessageDescription& description, MessageSyntax syntax, std::span<const Eigen::Vector3d> rates)
      : description_(description),
        text_(syntax),
        rates_(!rates.empty()),
        rate_rad_s_(rates),
        time_(description.time_scale) {}

  std::string write(const AttitudeHistory& attitude, Time epoch, const std::vector<std::size_t>& bounds) {
    constexpr std::size_t kRowLength = 420;
    text_.buffer().reserve(attitude.size() * (text_.kvn() ? kRowLength / 3 : kRowLength));
    text_.header("AEM", fmt::format("{}{} TAI", kEpochComment, format_epoch(epoch)), description_);
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
      segment(attitude, bounds[i], bounds[i + 1]);
    }
    text_.end("AEM");
    return text_.text();
  }

 private:
  void segment(const AttitudeHistory& attitude, std::size_t begin, std::size_t end) {
    text_.put("\nMETA_START\n", "<segment>\n<metadata>\n");
    text_.entry("OBJECT_NAME", description_.object_name);
    text_.entry("OBJECT_ID", description_.object_id);
    text_.entry("REF_FRAME_A", description_.inertial_frame);
    text_.entry("REF_FRAME_B", description_.body_frame);
    text_.entry("TIME_SYSTEM", name_of(description_.time_scale));
    text_.entry("START_TIME", time_.format(attitude.t[begin]));
    text_.entry("STOP_TIME", time_.format(attitude.t[end - 1]));
    text_.entry("ATTITUDE_TYPE", rates_ ? "QUATERNION/ANGVEL" : "QUATERNION");
    if (rates_) {
      text_.entry("ANGVEL_FRAME", description_.body_frame);
    }
    if (end - begin > 1) {  // a single state is not interpolated
      text_.entry("INTERPOLATION_METHOD", "LINEAR");
      text_.entry("INTERPOLATION_DEGREE", "1");
    }
    text_.put("META_STOP\n\nDATA_START\n", "</metadata>\n<data>\n");
    for (std::size_t i = begin; i < end; ++i) {
      check_stop();
      row(attitude, i);
    }
    text_.put("DATA_STOP\n", "</data>\n</segment>\n");
  }

  void row(const AttitudeHistory& attitude, std::size_t i) {
    const Eigen::Quaterniond& q = attitude.q_in_c[i];
    const std::string t = time_.format(attitude.t[i]);
    const auto out = fmt::appender(text_.buffer());
    const Eigen::Vector3d rate = rates_ ? Eigen::Vector3d(rate_rad_s_[i] * kDegreesPerRadian) : Eigen::Vector3d::Zero();
    if (text_.kvn()) {
      fmt::format_to(out, "{} {:.15e} {:.15e} {:.15e} {:.15e}", t, q.x(), q.y(), q.z(), q.w());
      if (rates_) {
        fmt::format_to(out, " {:.15e} {:.15e} {:.15e}", rate.x(), rate.y(), rate.z());
      }
      text_.put("\n");
      return;
    }
    fmt::format_to(out,
                   "<attitudeState><{0}><EPOCH>{1}</EPOCH><quaternion><Q1>{2:.15e}</Q1><Q2>{3:.15e}</Q2>"
                   "<Q3>{4:.15e}</Q3><QC>{5:.15e}</QC></quaternion>",
                   rates_ ? "quaternionAngVel" : "quaternionEphemeris", t, q.x(), q.y(), q.z(), q.w());
    if (rates_) {
      fmt::format_to(out,
                     "<angVel><ANGVEL_X units=\"deg/s\">{:.15e}</ANGVEL_X><ANGVEL_Y units=\"deg/s\">{:.15e}</ANGVEL_Y>"
                     "<ANGVEL_Z units=\"deg/s\">{:.15e}</ANGVEL_Z></angVel>",
                     rate.x(), rate.y(), rate.z());
    }
    text_.put(rates_ ? "</quaternionAngVel></attitudeState>\n" : "</quaternionEphemeris></attitudeState>\n");
  }

  const MessageDescription& description_;
  NdmText text_;
  bool rates_;
  std::span<const Eigen::Vector3d> rate_rad_s_;
  TimeText time_;
};

}  // namespace

void expect_writable_description(const MessageDescription& description) {
  expect_plain(description.object_name, "the name of the spacecraft,");
  expect_plain(description.object_id, "--object-id");
  expect_plain(description.originator, "--originator");
  if (!is_inertial_frame(description.inertial_frame)) {
    throw UsageError(fmt::format("--inertial-frame {}: give one of {}", description.inertial_frame, kInertialFrames));
  }
  if (!is_spacecraft_frame(description.body_frame)) {
    throw UsageError(fmt::format("--body-frame {}: give a name like {}", description.body_frame, kSpacecraftFrames));
  }
}

Duration usual_gap(const AttitudeHistory& attitude) {
  if (attitude.size() < 2) {
    return Duration::max();
  }
  std::vector<Duration> steps;
  steps.reserve(attitude.size() - 1);
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    steps.push_back(attitude.t[i] - attitude.t[i - 1]);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle + *middle / 2;
}

std::vector<std::size_t> stretches(const AttitudeHistory& attitude, Duration gap) {
  std::vector<std::size_t> bounds = {0};
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    if (attitude.t[i] - attitude.t[i - 1] > gap) {
      bounds.push_back(i);
    }
  }
  bounds.push_back(attitude.size());
  return bounds;
}

std::string format_aem(const AttitudeHistory& attitude, std::span<const Eigen::Vector3d> rate_rad_s, Time epoch,
                       const MessageDescription& description, Duration gap, MessageSyntax syntax) {
  expect_writable_description(description);
  return AemWriter(description, syntax, rate_rad_s).write(attitude, epoch, stretches(attitude, gap));
}

bool is_attitude_message(std::string_view text) { return is_xml(text) || without_lead(text).starts_with("CCSDS_"); }

AttitudeMessage parse_attitude_message(std::string_view text, const std::filesystem::path& file) {
  if (ndm_kind(text) == "APM") {
    return parse_apm(text, file);
  }
  return is_xml(text) ? parse_aem_xml(text, file) : parse_aem_kvn(text, file);
}

AttitudeMessage read_attitude_message(const std::filesystem::path& file) {
  const TextFile content(file);
  return parse_attitude_message(content.text(), file);
}

}  // namespace trihedron::io
