#pragma once
/// From the keywords and rows of an AEM to attitude, whatever syntax they were written in.

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {

/// A word of the file and where it stands.
struct AemField {
  std::string_view text;
  Position at;
};

/// Takes the parts of a message in their order; each function throws InputRefused for what is wrong.
class AemBuilder {
 public:
  /// `version`: the text after CCSDS_AEM_VERS.
  AemBuilder(std::filesystem::path file, AemField version, std::string_view syntax);

  /// What data lines hold beside epoch and quaternion.
  enum class Kind { kQuaternion, kDerivative, kAngularVelocity, kEulerRate };

  void comment(std::string_view text);
  void header(AemField key, AemField value);
  void begin_segment(Position at);
  void metadata(AemField key, AemField value);
  void end_metadata(Position at);
  [[nodiscard]] Kind kind() const { return kind_; }
  /// Whether the scalar stands first in data lines, as version 1 may say.
  [[nodiscard]] bool scalar_first() const { return scalar_first_; }
  /// Epoch, Q1, Q2, Q3, QC, and by kind their derivatives in this order, or the three rates.
  void row(std::span<const AemField> fields);
  void end_segment(Position at) const;
  [[nodiscard]] AttitudeMessage finish(Position at);

  [[noreturn]] void refuse(Position at, std::string reason, std::string cure) const;

 private:
  struct Entry {
    std::string value;
    Position at;
  };
  using Entries = std::map<std::string, Entry, std::less<>>;

  void end_header(Position at);
  void take_entry(Entries& entries, AemField key, AemField value, std::span<const std::string_view> known,
                  std::string_view section) const;
  [[nodiscard]] const Entry& needed(const Entries& entries, const std::string& key, Position at,
                                    std::string_view section) const;
  [[nodiscard]] Time time_of(std::string_view text, Position at);
  void take_frames(Position at);
  void take_time_span(Position at);
  void take_type(Position at);
  [[nodiscard]] double number(AemField field) const;
  [[nodiscard]] Eigen::Vector3d rate_of(const Eigen::Quaterniond& given, std::span<const AemField> fields) const;

  std::filesystem::path file_;
  int version_;
  AttitudeMessage message_;
  Entries header_;
  bool header_ended_ = false;

  // Of the segment.
  Entries metadata_;
  TimeText time_{TimeScale::kTai};
  Time start_{};
  Time stop_{};
  Time useable_start_{};
  Time useable_stop_{};
  bool reversed_ = false;  ///< the quaternion as given turns components in the inertial frame into the body's
  bool scalar_first_ = false;
  bool rate_in_a_ = false;
  bool a_is_body_ = false;
  Kind kind_ = Kind::kQuaternion;
  std::size_t rows_ = 0;
  Time last_{};
  std::size_t used_ = 0;
  bool all_have_rates_ = true;
};

}  // namespace trihedron::io
