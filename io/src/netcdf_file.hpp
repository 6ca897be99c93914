#pragma once
/// NetCDF-4 by groups that hold columns along the dimension `time`. The library below is not thread-safe: one file at a
/// time.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "series.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/residuals.hpp"

namespace trihedron::io {

/// The dimension and the time column of every group.
inline constexpr const char* kTimeDimension = "time";
inline constexpr const char* kTimeColumn = "t_s";

/// A file open for reading. Everything throws InputRefused when the file is not what it should be.
class NetcdfReader {
 public:
  explicit NetcdfReader(std::filesystem::path file);
  NetcdfReader(const NetcdfReader&) = delete;
  NetcdfReader& operator=(const NetcdfReader&) = delete;
  ~NetcdfReader();

  [[nodiscard]] bool has_group(const std::string& group) const;
  /// A text attribute of a group, of the root when `group` is empty; nullopt when there is none.
  [[nodiscard]] std::optional<std::string> text_attribute(const std::string& group, const std::string& name) const;
  /// The columns of a group, CF-packed or not, pure numbers but for t_s. `epoch` must be the one in the units of t_s
  /// where those name one.
  [[nodiscard]] Series read_group(const std::string& group, Time epoch, ChooseRules choose) const;
  /// Variables by their paths ("group/name"), of one row each along a dimension that all have in common or that has the
  /// same length; "name[i]" is column i of one with two dimensions. CF-packed or not, whatever their units are.
  [[nodiscard]] std::vector<std::vector<double>> read_variables(std::span<const std::string> paths) const;

 private:
  [[noreturn]] void refuse(std::string reason, std::string cure) const;
  void check(int status, const std::string& doing) const;
  [[nodiscard]] int group_id(const std::string& group) const;
  [[nodiscard]] std::optional<std::string> text_attribute(int group, int variable, const char* name) const;
  [[nodiscard]] std::optional<double> number_attribute(int group, int variable, const char* name) const;
  void check_time_units(const std::string& group, int id, int variable, Time epoch) const;
  /// Refuses a group that declares more rows than the file can hold of these variables, however it is compressed.
  void check_rows(const std::string& group, int id, std::span<const int> variables, std::size_t rows) const;
  /// Throws InputRefused where a column that is a pure number claims a unit, such as degrees.
  void check_units(const std::string& group, int id, int variable, const std::string& name) const;
  void read_column(int id, int variable, std::vector<double>& values) const;
  void unpack(int id, int variable, std::vector<double>& values) const;

  std::filesystem::path file_;
  int id_ = -1;
};

/// A column to write; with an `lsb` it is CF-packed into 32-bit integers, unless a value does not fit.
struct PackedColumn : Column {
  double lsb = 0;
};

/// A variable over named dimensions, the last of which changes first, with its attributes: all texts but flag_values,
/// which are whole numbers.
struct ShapedVariable {
  std::string name;
  std::vector<std::string> dimensions;
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<std::string>> values;
  std::vector<std::pair<std::string, std::string>> attributes;
};

/// A file being written under a temporary name; it appears at commit(). Everything throws MachineFailed on failure.
class NetcdfWriter {
 public:
  explicit NetcdfWriter(const std::filesystem::path& path);
  NetcdfWriter(const NetcdfWriter&) = delete;
  NetcdfWriter& operator=(const NetcdfWriter&) = delete;
  ~NetcdfWriter();

  void write_attribute(const std::string& group, const std::string& name, const std::string& text);
  void write_group(const std::string& group, Time epoch, std::span<const Time> t,
                   std::span<const PackedColumn> columns);
  /// In the root; `dimensions` by name and length. Values must fill them.
  void write_variables(std::span<const std::pair<std::string, std::size_t>> dimensions,
                       std::span<const ShapedVariable> variables);
  void commit();

 private:
  void check(int status) const;
  [[nodiscard]] int group_id(const std::string& group);
  [[nodiscard]] int define(int group, int dimension, const Column& column, bool packed, double lsb) const;

  std::filesystem::path path_;
  AtomicFile file_;
  int id_ = -1;
};

}  // namespace trihedron::io
