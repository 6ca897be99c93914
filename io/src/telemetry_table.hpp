#pragma once
/// The columns of one table of another's telemetry, CSV, NetCDF or Parquet.

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "telemetry_map.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// A row without a stamp.
inline constexpr Time kNoTime = Time::min();

/// Instants of stamps, TAI.
class StampReader {
 public:
  explicit StampReader(const Stamps& stamps);
  /// kNoTime for what is no number, or stands for no time that is known.
  [[nodiscard]] Time of_number(double value);
  /// Of the format iso; a blank may stand between date and time. Nothing where it is no time, and why in `fault`.
  [[nodiscard]] std::optional<Time> of_text(std::string_view text, TimeText::Fault& fault);

 private:
  Stamps stamps_;
  TimeText clock_;
};

struct ForeignTable {
  std::filesystem::path file;
  std::string name;                          ///< for people
  std::int64_t first_line = 0;               ///< of the first row; 0 where there are no lines
  std::vector<std::size_t> row_in_file;      ///< counted from `first_line`; empty where that is its index
  std::vector<std::vector<Time>> stamps;     ///< by column
  std::vector<std::vector<double>> numbers;  ///< by column; NaN where missing
  std::int64_t cut_line = 0;                 ///< as in Series

  [[nodiscard]] std::size_t rows() const { return stamps.front().size(); }
};

/// Columns of instants and columns of numbers by their names. `directory`: where a relative name of the file stands.
/// Throws InputRefused with line and column, for a Parquet file where there are no `others` too.
[[nodiscard]] ForeignTable read_foreign_table(const TableMap& map, const std::filesystem::path& directory,
                                              const std::vector<std::string>& stamps,
                                              const std::vector<std::string>& numbers, const ReadColumns& others);

/// Intervals that a file of the map holds. Throws InputRefused.
[[nodiscard]] std::vector<LeftOut> read_intervals(const IntervalMap& map, const std::filesystem::path& directory,
                                                  const ReadColumns& others = {});

/// The same of the text of a CSV file; `file` is for messages.
[[nodiscard]] ForeignTable parse_foreign_csv(std::string_view text, const std::filesystem::path& file,
                                             const TableMap& map, const std::vector<std::string>& stamps,
                                             const std::vector<std::string>& numbers);

}  // namespace trihedron::io
