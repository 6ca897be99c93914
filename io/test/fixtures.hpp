#pragma once
/// A small clean pass to spoil, in every format, and help to look at refusals.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <Eigen/Core>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A directory that is gone with its content at the end of the test.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }
  /// Everything in it by name, hidden files too.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

/// Another user for a while, where the test runs as root: root may write into read-only directories.
class NotRoot {
 public:
  explicit NotRoot(const std::filesystem::path& directory) : was_root_(::geteuid() == 0) {
    constexpr ::uid_t kNobody = 65534;
    if (was_root_ && (::chown(directory.c_str(), kNobody, kNobody) != 0 || ::seteuid(kNobody) != 0)) {
      throw std::runtime_error("cannot become another user");
    }
  }
  ~NotRoot() {
    if (was_root_ && ::seteuid(0) != 0) {
      std::abort();
    }
  }
  NotRoot(const NotRoot&) = delete;
  NotRoot& operator=(const NotRoot&) = delete;

 private:
  bool was_root_;
};

/// Makes every file of this process end at `bytes`, as a full disk would.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_{};
  void (*old_handler_)(int) = SIG_DFL;
};

void write_text(const std::filesystem::path& file, std::string_view text);
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// Rows as a file holds them, t_s first.
struct RawTable {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;

  [[nodiscard]] std::string csv() const;
};

/// 90 s of two gyros at 2 Hz and fixes every 3 s, without a flaw; and its truth.
struct RawPass {
  std::string toml;
  RawTable gyro;
  RawTable star_tracker;

  void save_directory(const std::filesystem::path& directory) const;
  /// Plain doubles, written with the NetCDF library alone: independent of the module's own writer.
  void save_netcdf(const std::filesystem::path& file, const char* dimension = "time") const;
};
[[nodiscard]] RawPass clean_pass();
[[nodiscard]] Truth clean_truth();
[[nodiscard]] Calibration sample_calibration();
/// With drift at orbital period of both gyros, told from its epoch on, and what it has in common with a coefficient.
/// At orbital period, and with the polhodes.
[[nodiscard]] Calibration sample_with_drift_that_comes_back();

/// An OEM of twenty minutes of a round orbit from the epoch of clean_pass() on, in two segments, KVN or XML.
[[nodiscard]] std::string orbit_message(bool xml);

/// what() of the InputRefused that `action` throws; empty when it throws none.
template <class Action>
std::string refusal(Action action) {
  try {
    action();
  } catch (const InputRefused& refused) {
    return refused.what();
  }
  return {};
}

/// The defect of this kind; fails the test when there is not exactly one.
[[nodiscard]] Defect only(const std::vector<Defect>& defects, Defect::Kind kind);

/// Replaces the first occurrence; fails the test when there is none.
[[nodiscard]] std::string replaced(std::string text, std::string_view from, std::string_view to);

/// Field by field, telemetry with NaN equal to NaN.
void expect_same_pass(const Pass& a, const Pass& b, double h_tolerance, double q_tolerance);

}  // namespace trihedron::io
