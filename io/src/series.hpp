#pragma once
/// A table against time, as any format delivers it; and which columns each table of a pass has.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trihedron/io/error.hpp"

namespace trihedron::io {

/// One named column and where the file names it.
struct ColumnName {
  std::string name;
  Position position;
};

/// The columns that a table must and may have in addition to `t_s`.
struct ColumnRules {
  std::vector<std::string> required;
  std::vector<std::string> optional;
  bool others_allowed = false;  ///< others are skipped, else refused
};

/// Rules may depend on the columns present: these give the number of gyros.
using ChooseRules = ColumnRules (*)(const std::filesystem::path& file, std::span<const ColumnName> present);

ColumnRules gyro_columns(const std::filesystem::path& file, std::span<const ColumnName> present);
ColumnRules star_tracker_columns(const std::filesystem::path& file, std::span<const ColumnName> present);
ColumnRules truth_columns(const std::filesystem::path& file, std::span<const ColumnName> present);
ColumnRules attitude_columns(const std::filesystem::path& file, std::span<const ColumnName> present);

/// "h1_x", "h1_y", "h1_z", "h2_x" …
[[nodiscard]] std::vector<std::string> direction_names(int gyros);

/// Of the covariance of a fix: "cov_xx_rad2", yy, zz, then xy, xz, yz.
[[nodiscard]] const std::vector<std::string>& covariance_names();
/// Of them the first three alone may be there: the others are 0 then.
inline constexpr std::size_t kVariances = 3;

/// Rows exactly as in the file: nothing is left out, and times need not increase.
struct Series {
  std::filesystem::path file;
  std::string name;                  ///< for people: "gyro.csv", "group gyro"
  std::int64_t first_line = 0;       ///< of the first row; 0 where the format has no lines
  std::vector<std::string> columns;  ///< in the order of the rules, without t_s
  std::vector<double> t_s;
  std::vector<double> values;  ///< row-major, columns.size() per row; NaN where missing
  std::int64_t cut_line = 0;   ///< of a last line that was cut short and left out; 0 when there is none
  /// Where each row stands in the file, counted from `first_line`; empty where that is its index.
  std::vector<std::size_t> row_in_file;

  [[nodiscard]] std::size_t rows() const { return t_s.size(); }
  [[nodiscard]] std::size_t place(std::size_t i) const { return i < row_in_file.size() ? row_in_file[i] : i; }
  [[nodiscard]] const double* row(std::size_t i) const { return values.data() + i * columns.size(); }
  [[nodiscard]] Position position(std::size_t row_index) const {
    if (row_index == rows() && cut_line > 0) {
      return {cut_line, 0};
    }
    return {first_line > 0 ? first_line + static_cast<std::int64_t>(place(row_index)) : 0, 0};
  }
};

/// The line of column names for a table of so many columns, `t_s` included: of the variants of the rules, for other
/// numbers of gyros, for fixes with their covariance, for attitudes with sigmas and age, the one that has as many.
/// Empty where none has.
[[nodiscard]] std::string header_for(const std::filesystem::path& file, ChooseRules choose, std::size_t columns);

/// Where each present column goes.
struct ColumnPlan {
  static constexpr int kTime = -1;
  static constexpr int kSkip = -2;
  std::vector<int> target;           ///< per present column: index in `columns`, kTime or kSkip
  std::vector<std::string> columns;  ///< required ones, then the optional ones that are there
};

/// Throws InputRefused when a column is missing, unknown or there twice.
[[nodiscard]] ColumnPlan plan_columns(const std::filesystem::path& file, std::span<const ColumnName> present,
                                      ChooseRules choose);

}  // namespace trihedron::io
