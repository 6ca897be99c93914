#include "trihedron/io/attitude.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "attitude_rules.hpp"
#include "ck_reader.hpp"
#include "csv.hpp"
#include "text_file.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

[[noreturn]] void refuse(const Series& series, std::size_t row, std::string reason) {
  throw InputRefused(series.file, series.position(row), std::move(reason), "repair or remove the line");
}

constexpr std::string_view kBodyColumns = ",q_body_x,q_body_y,q_body_z,q_body_w";

Eigen::Quaterniond q_c_body_of(const Mounting& mounting) {
  const Eigen::Vector3d turn = mounting.value_or(Eigen::Vector3d::Zero());
  const double angle = turn.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(-angle, turn / angle)) : Eigen::Quaterniond::Identity();
}

}  // namespace

AttitudeHistory read_attitude(const std::filesystem::path& path, Time epoch) {
  return read_attitude_of_any_format(path, epoch).attitude;
}

AttitudeMessage read_attitude_of_any_format(const std::filesystem::path& path, std::optional<Time> given_epoch) {
  const TextFile content(path);
  if (is_c_kernel(content.text())) {
    return read_c_kernel(content.text(), path);
  }
  if (is_attitude_message(content.text())) {
    return parse_attitude_message(content.text(), path);
  }
  if (begins_as_json(content.text())) {
    throw InputRefused(path, {}, "is JSON, as calibration.json is, and no attitude",
                       "give an attitude: attitude.csv, a message (AEM, APM) or a C-kernel of SPICE; of a calibration "
                       "`export` writes acm, acm-xml and fk");
  }
  if (!given_epoch) {
    throw UsageError("an attitude file counts t_s from the epoch of its pass: give the pass by --pass, or --epoch");
  }
  const Time epoch = *given_epoch;
  const Series series = parse_csv(content, path, attitude_columns);
  if (series.cut_line > 0) {
    throw InputRefused(path, {series.cut_line, 0}, "the last line is cut short", "write the file again");
  }
  if (series.rows() == 0) {
    throw InputRefused(path, {}, "holds no attitude", "give a file with rows");
  }
  const auto has = [&](const char* column) { return std::ranges::count(series.columns, column) > 0; };
  const bool has_sigma = has("sigma_x_rad");
  const bool has_rate = has("rate_x_rad_s");
  const bool has_age = has("age_s");
  AttitudeMessage message;
  message.format = "attitude file";
  message.inertial_frame = "ICRF";
  message.time_system = "TAI";
  message.epoch = epoch;
  AttitudeHistory& attitude = message.attitude;
  for (std::size_t i = 0; i < series.rows(); ++i) {
    const double* row = series.row(i);
    if (!(std::abs(series.t_s[i]) < 1e9)) {
      refuse(series, i, "t_s is missing or not below 1e9 s");
    }
    const Time t = epoch + from_seconds(series.t_s[i]);
    if (i > 0 && t <= attitude.t.back()) {
      refuse(series, i, "the time stamp does not increase");
    }
    const Eigen::Quaterniond q(row[3], row[0], row[1], row[2]);
    if (!is_unit(q)) {
      refuse(series, i, "q is not a unit quaternion");
    }
    attitude.t.push_back(t);
    attitude.q_in_c.push_back(q);
    if (has_sigma) {
      const Eigen::Vector3d sigma(row[4], row[5], row[6]);
      if ((sigma.array() <= 0).any()) {
        refuse(series, i, "a sigma is not positive");
      }
      attitude.sigma_rad.push_back(sigma);
    }
    const double* next = row + (has_sigma ? 7 : 4);
    if (has_rate) {
      const Eigen::Vector3d rate(next[0], next[1], next[2]);
      if (!rate.allFinite()) {
        refuse(series, i, "a rate is missing");
      }
      message.rate_rad_s.push_back(rate);
      next += 3;
    }
    if (has_age) {
      const double age_s = *next;
      if (!(age_s >= 0 && age_s < 1e9)) {
        refuse(series, i, "age_s is not between 0 and 1e9 s");
      }
      attitude.age_s.push_back(age_s);
    }
  }
  return message;
}

std::string format_attitude_rows(Time epoch, const AttitudeHistory& attitude, AttitudeDigits digits,
                                 std::span<const Eigen::Vector3d> rate_rad_s, const Mounting& mounting) {
  const Eigen::Quaterniond q_c_body = q_c_body_of(mounting);
  const bool has_sigma = !attitude.sigma_rad.empty();
  const bool has_rate = !rate_rad_s.empty();
  const bool has_age = !attitude.age_s.empty();
  if (attitude.q_in_c.size() != attitude.size() || (has_sigma && attitude.sigma_rad.size() != attitude.size()) ||
      (has_rate && rate_rad_s.size() != attitude.size()) || (has_age && attitude.age_s.size() != attitude.size())) {
    throw std::invalid_argument("the columns of an attitude history differ in length");
  }
  fmt::memory_buffer out;
  constexpr std::size_t kLineLength = 120;
  out.reserve(attitude.size() * kLineLength);
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    check_stop();
    const Eigen::Quaterniond& q = attitude.q_in_c[i];
    const std::string t_s = format_seconds(attitude.t[i] - epoch);
    if (digits == AttitudeDigits::kAll) {
      fmt::format_to(fmt::appender(out), "{},{},{},{},{}", t_s, q.x(), q.y(), q.z(), q.w());
    } else {
      fmt::format_to(fmt::appender(out), "{},{:.12f},{:.12f},{:.12f},{:.12f}", t_s, q.x(), q.y(), q.z(), q.w());
    }
    if (has_sigma) {
      const Eigen::Vector3d& sigma = attitude.sigma_rad[i];
      fmt::format_to(fmt::appender(out), ",{:.6e},{:.6e},{:.6e}", sigma.x(), sigma.y(), sigma.z());
    }
    if (has_age) {
      fmt::format_to(fmt::appender(out), ",{:.3f}", attitude.age_s[i]);
    }
    if (has_rate) {
      const Eigen::Vector3d& rate = rate_rad_s[i];
      fmt::format_to(fmt::appender(out), ",{},{},{}", rate.x(), rate.y(), rate.z());
    }
    if (mounting) {
      const Eigen::Quaterniond body = q * q_c_body;
      fmt::format_to(fmt::appender(out), ",{:.12f},{:.12f},{:.12f},{:.12f}", body.x(), body.y(), body.z(), body.w());
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

std::string format_attitude(Time epoch, const AttitudeHistory& attitude, AttitudeDigits digits,
                            std::span<const Eigen::Vector3d> rate_rad_s, const Mounting& mounting) {
  const std::string_view names = kAttitudeColumns.substr(0, kAttitudeColumns.size() - 1);
  const std::size_t sigmas = names.find(",sigma_x_rad");
  const std::size_t age = names.find(",age_s");
  return fmt::format("{}{}{}{}{}\n{}", names.substr(0, sigmas),
                     attitude.sigma_rad.empty() ? "" : names.substr(sigmas, age - sigmas),
                     attitude.age_s.empty() ? "" : names.substr(age),
                     rate_rad_s.empty() ? "" : ",rate_x_rad_s,rate_y_rad_s,rate_z_rad_s", mounting ? kBodyColumns : "",
                     format_attitude_rows(epoch, attitude, digits, rate_rad_s, mounting));
}

std::string attitude_header(const Mounting& mounting) {
  return fmt::format("{}{}\n", kAttitudeColumns.substr(0, kAttitudeColumns.size() - 1), mounting ? kBodyColumns : "");
}

void write_attitude(const std::filesystem::path& path, Time epoch, const AttitudeHistory& attitude,
                    const Mounting& mounting) {
  write_file(path, format_attitude(epoch, attitude, AttitudeDigits::kTwelveDecimals, {}, mounting));
}

}  // namespace trihedron::io
