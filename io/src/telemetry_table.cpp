#include "telemetry_table.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "netcdf_input.hpp"
#include "text_file.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr double kMjdOf1958 = 36204;
constexpr double kJdOf1958 = 2436204.5;
constexpr double kMostSeconds = 9.2e9;  // that Time holds

bool is_netcdf(const fs::path& file) {
  const fs::path extension = file.extension();
  return extension == ".nc" || extension == ".nc4" || extension == ".cdf";
}

bool is_parquet(const fs::path& file) {
  const fs::path extension = file.extension();
  return extension == ".parquet" || extension == ".pq";
}

/// A field of a line: its text without blanks and quotation marks around it, and where it begins, from 0.
struct CsvField {
  std::string_view text;
  std::size_t begin = 0;
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Fields of a line. A field in quotation marks may hold the separator.
void split_fields(std::string_view line, char separator, std::vector<CsvField>& fields) {
  fields.clear();
  const bool by_blanks = separator == ' ';
  while (!line.empty() && (line.back() == '\r' || (by_blanks && is_blank(line.back())))) {
    line.remove_suffix(1);
  }
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_blank(line[at]) && line[at] != separator) {
      ++at;
    }
    while (by_blanks && at < line.size() && is_blank(line[at])) {
      ++at;
    }
    const bool quoted = at < line.size() && line[at] == '"';
    const std::size_t begin = quoted ? at + 1 : at;
    const std::size_t quote = quoted ? line.find('"', begin) : std::string_view::npos;
    std::size_t next = quote == std::string_view::npos ? begin : quote + 1;
    while (next < line.size() && line[next] != separator && !(by_blanks && is_blank(line[next]))) {
      ++next;
    }
    const std::size_t end = quote == std::string_view::npos ? next : quote;
    fields.push_back({quoted ? line.substr(begin, end - begin) : trimmed(line.substr(begin, end - begin)), begin});
    if (next >= line.size()) {
      return;
    }
    at = next + 1;
  }
}

/// Splits a text into lines.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : rest_(text) {}

  [[nodiscard]] bool next() {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = rest_.find('\n');
    is_ended_ = end != std::string_view::npos;
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(is_ended_ ? end + 1 : rest_.size());
    ++number_;
    return true;
  }
  [[nodiscard]] std::string_view line() const { return line_; }
  [[nodiscard]] std::int64_t number() const { return number_; }
  /// Whether the line is the last, and has no newline.
  [[nodiscard]] bool is_unended() const { return !is_ended_; }

 private:
  std::string_view rest_;
  std::string_view line_;
  std::int64_t number_ = 0;
  bool is_ended_ = true;
};

struct Header {
  std::vector<std::string> names;
  std::vector<std::size_t> begin;
  std::int64_t line = 0;
};

/// Place of a column in the header.
std::size_t column_named(const std::string& name, const Header& header, const fs::path& file) {
  const auto found = std::ranges::find(header.names, name);
  if (found == header.names.end()) {
    const std::vector<std::string_view> known(header.names.begin(), header.names.end());
    const std::size_t other = known.size() == 1 ? known.front().find_first_of(",;\t") : std::string_view::npos;
    if (other != std::string_view::npos) {
      throw InputRefused(file, {header.line, static_cast<std::int64_t>(header.begin.front() + other) + 1},
                         fmt::format("lacks column {}: the line is a single field", in_quotes(name)),
                         fmt::format("give separator = \"{}\" in its table of the telemetry.toml",
                                     known.front()[other] == '\t' ? "\\t" : known.front().substr(other, 1)));
    }
    throw InputRefused(file, {header.line, 0}, fmt::format("lacks column {}", in_quotes(name)),
                       suggestion(name, known));
  }
  const auto again = std::find(found + 1, header.names.end(), name);
  if (again != header.names.end()) {
    throw InputRefused(
        file,
        {header.line,
         static_cast<std::int64_t>(header.begin[static_cast<std::size_t>(again - header.names.begin())]) + 1},
        fmt::format("column {} is there twice", in_quotes(name)),
        "rename one of them, or give header_line = 0 and name columns by their number");
  }
  return static_cast<std::size_t>(found - header.names.begin());
}

double number_in(const CsvField& field, const TableMap& map, const fs::path& file, std::int64_t line,
                 const std::string& column) {
  double value = std::numeric_limits<double>::quiet_NaN();
  if (field.text.empty() || std::ranges::find(map.missing, field.text) != map.missing.end()) {
    return value;
  }
  const char* first = field.text.data();
  const char* const last = first + field.text.size();
  first += *first == '+' && field.text.size() > 1 && first[1] != '-' ? 1 : 0;
  const auto [end, fault] = fast_float::from_chars(first, last, value);
  if (fault != std::errc() || end != last) {
    const bool has_decimal_comma = std::ranges::count(field.text, ',') == 1 && end < last && *end == ',';
    throw InputRefused(file, {line, static_cast<std::int64_t>(field.begin) + 1},
                       fmt::format("{} of column {} is not a number", in_quotes(field.text), in_quotes(column)),
                       has_decimal_comma
                           ? "write numbers with decimal points, not commas"
                           : "repair the field, or name the text in \"missing\" where it stands for no value");
  }
  return value;
}

Time time_in(const CsvField& field, const TableMap& map, StampReader& reader, const fs::path& file, std::int64_t line,
             const std::string& column) {
  if (map.stamps.format != Stamps::Format::kIso) {
    return reader.of_number(number_in(field, map, file, line, column));
  }
  if (field.text.empty() || std::ranges::find(map.missing, field.text) != map.missing.end()) {
    return kNoTime;
  }
  TimeText::Fault fault;
  const std::optional<Time> time = reader.of_text(field.text, fault);
  if (!time) {
    throw InputRefused(file, {line, static_cast<std::int64_t>(field.begin) + 1},
                       fmt::format("column {}: {}", in_quotes(column), fault.reason), fault.cure);
  }
  return *time;
}

ForeignTable read_netcdf_table(const fs::path& file, const TableMap& map, const std::vector<std::string>& stamps,
                               const std::vector<std::string>& numbers) {
  std::vector<std::string> paths = stamps;
  paths.insert(paths.end(), numbers.begin(), numbers.end());
  std::vector<std::vector<double>> columns = NetcdfInput(file).read_variables(paths);
  ForeignTable table;
  table.file = file;
  table.name = file.filename().string();
  StampReader reader(map.stamps);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    std::vector<Time>& times = table.stamps.emplace_back();
    std::ranges::transform(columns[i], std::back_inserter(times),
                           [&](double value) { return reader.of_number(value); });
  }
  columns.erase(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(stamps.size()));
  table.numbers = std::move(columns);
  return table;
}

/// Of a file that `others` reads.
ForeignTable read_table_of_others(const fs::path& file, const TableMap& map, const std::vector<std::string>& stamps,
                                  const std::vector<std::string>& numbers, const ReadColumns& others) {
  std::vector<std::string> columns = stamps;
  columns.insert(columns.end(), numbers.begin(), numbers.end());
  TableMap as_written;  // commas, names in the first line
  as_written.stamps = map.stamps;
  as_written.missing = map.missing;
  ForeignTable table = parse_foreign_csv(others(file, columns), file, as_written, stamps, numbers);
  table.first_line = 0;  // its rows have no lines
  table.row_in_file.clear();
  return table;
}

}  // namespace

StampReader::StampReader(const Stamps& stamps) : stamps_(stamps), clock_(stamps.scale) {}

Time StampReader::of_number(double value) {
  using Format = Stamps::Format;
  const double origin = stamps_.format == Format::kMjd ? kMjdOf1958 : stamps_.format == Format::kJd ? kJdOf1958 : 0;
  const double seconds = (value - origin) * stamps_.unit_s;
  const Time since = stamps_.since.value_or(Time{});
  if (!(std::abs(seconds) + std::abs(to_seconds(since.time_since_epoch())) < kMostSeconds)) {
    return kNoTime;
  }
  if (stamps_.leap_seconds_counted.value_or(false)) {
    const std::optional<Time> start = clock_.tai_of(since);
    return start ? *start + from_seconds(seconds) : kNoTime;
  }
  return clock_.tai_of(since + from_seconds(seconds)).value_or(kNoTime);
}

std::optional<Time> StampReader::of_text(std::string_view text, TimeText::Fault& fault) {
  constexpr std::size_t kDate = 10;
  if (text.size() > kDate && text[kDate] == ' ') {
    std::string with_t(text);
    with_t[kDate] = 'T';
    return clock_.parse(with_t, fault);
  }
  return clock_.parse(text, fault);
}

ForeignTable parse_foreign_csv(std::string_view text, const fs::path& file, const TableMap& map,
                               const std::vector<std::string>& stamps, const std::vector<std::string>& numbers) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  refuse_other_than_text(text, file);
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw InputRefused(file, {}, "is empty", "give a file with the columns that the telemetry.toml names");
  }

  const char separator = map.separator.front();
  std::vector<CsvField> fields;
  Header header;
  TextLines lines(text);
  while (lines.number() < map.header_line && lines.next()) {
  }
  if (lines.number() < map.header_line) {
    throw InputRefused(
        file, {},
        fmt::format("has {} lines, and its columns are to be named in line {}", lines.number(), map.header_line),
        "give the number of that line as header_line");
  }
  if (map.header_line > 0) {
    split_fields(lines.line(), separator, fields);
    header.line = lines.number();
    for (const CsvField& field : fields) {
      header.names.emplace_back(field.text);
      header.begin.push_back(field.begin);
    }
  }

  ForeignTable table;
  table.file = file;
  table.name = file.filename().string();
  table.stamps.resize(stamps.size());
  table.numbers.resize(numbers.size());
  std::vector<std::size_t> stamp_at;
  std::vector<std::size_t> number_at;
  const auto find_columns = [&] {
    for (const std::string& name : stamps) {
      stamp_at.push_back(column_named(name, header, file));
    }
    for (const std::string& name : numbers) {
      number_at.push_back(column_named(name, header, file));
    }
  };
  if (map.header_line > 0) {
    find_columns();
  }
  StampReader reader(map.stamps);
  std::vector<Time> row_stamps(stamps.size());
  std::vector<double> row_numbers(numbers.size());
  while (lines.next()) {
    check_stop();
    const std::string_view line = lines.line();
    if (trimmed(line).empty() || (!map.comment.empty() && line.starts_with(map.comment))) {
      continue;
    }
    split_fields(line, separator, fields);
    if (header.names.empty()) {
      for (std::size_t i = 0; i < fields.size(); ++i) {
        header.names.push_back(fmt::to_string(i + 1));
        header.begin.push_back(fields[i].begin);
      }
      find_columns();
    }
    if (fields.size() != header.names.size()) {
      if (lines.is_unended() && fields.size() < header.names.size()) {
        table.cut_line = lines.number();
        break;
      }
      throw InputRefused(file, {lines.number(), 1},
                         fmt::format("the line has {} field{}, the {} {}", fields.size(), fields.size() == 1 ? "" : "s",
                                     map.header_line > 0 ? "header" : "first row", header.names.size()),
                         "repair or remove the line, or give the separator, comment or header_line of the file");
    }
    if (table.first_line == 0) {
      table.first_line = lines.number();
    }
    try {
      for (std::size_t i = 0; i < stamps.size(); ++i) {
        row_stamps[i] = time_in(fields[stamp_at[i]], map, reader, file, lines.number(), stamps[i]);
      }
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        row_numbers[i] = number_in(fields[number_at[i]], map, file, lines.number(), numbers[i]);
      }
    } catch (const InputRefused&) {
      if (!lines.is_unended()) {
        throw;
      }
      table.cut_line = lines.number();
      break;
    }
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      table.stamps[i].push_back(row_stamps[i]);
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      table.numbers[i].push_back(row_numbers[i]);
    }
    table.row_in_file.push_back(static_cast<std::size_t>(lines.number() - table.first_line));
  }
  return table;
}

ForeignTable read_foreign_table(const TableMap& map, const fs::path& directory, const std::vector<std::string>& stamps,
                                const std::vector<std::string>& numbers, const ReadColumns& others) {
  const fs::path file = directory / map.file;
  if (is_netcdf(file) && map.stamps.format == Stamps::Format::kIso) {
    throw InputRefused(file, {}, "is NetCDF, where stamps are numbers, and the format of time is iso",
                       "give format = \"s\" or another unit, and since, as the attribute units of the variable has it");
  }
  if (is_parquet(file) && !others) {
    throw InputRefused(file, {}, "is Parquet, for which this program has no library",
                       "make a pass of it with the Python package (pip install 'trihedron[parquet]'): python3 -c "
                       "\"import trihedron; trihedron.read_pass('telemetry.toml').to_netcdf('pass.nc')\"");
  }
  if (others && (is_parquet(file) || is_netcdf(file))) {
    return read_table_of_others(file, map, stamps, numbers, others);
  }
  return is_netcdf(file) ? read_netcdf_table(file, map, stamps, numbers)
                         : parse_foreign_csv(TextFile(file).text(), file, map, stamps, numbers);
}

}  // namespace trihedron::io
