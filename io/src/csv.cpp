#include "csv.hpp"

#include <fast_float/fast_float.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

const char* skip_blanks(const char* p) {
  while (*p == ' ' || *p == '\t' || *p == '\r') {
    ++p;
  }
  return p;
}

/// One number, NaN for an empty field. Returns where the field ends, nullptr when it holds no number. The text must be
/// terminated by '\n'.
const char* parse_field(const char* p, const char* end, double& value) {
  p = skip_blanks(p);
  const char* digits = *p == '+' && p[1] != '-' ? p + 1 : p;
  const auto [next, fault] = fast_float::from_chars(digits, end, value);
  if (fault == std::errc()) {
    return skip_blanks(next);
  }
  value = std::numeric_limits<double>::quiet_NaN();
  return *p == ',' || *p == '\n' ? p : nullptr;
}

const char* field_end(const char* p) {
  while (*p != ',' && *p != '\n') {
    ++p;
  }
  return p;
}

std::vector<ColumnName> parse_header(std::string_view line) {
  std::vector<ColumnName> names;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    names.push_back({std::string(trimmed(line.substr(begin, end - begin))), {1, static_cast<std::int64_t>(begin) + 1}});
    begin = end + 1;
  }
  return names;
}

/// Whether the fields of the first line are numbers, or empty: a row in place of the names.
bool is_row_of_numbers(std::span<const ColumnName> header) {
  const auto is_empty = [](const ColumnName& column) { return column.name.empty(); };
  const auto is_number = [](const ColumnName& column) {
    const std::string field = column.name + '\n';
    double value = 0;
    const char* end = parse_field(field.data(), field.data() + field.size(), value);
    return !column.name.empty() && end == field.data() + column.name.size();
  };
  return std::ranges::any_of(header, is_number) &&
         std::ranges::all_of(header, [&](const ColumnName& column) { return is_empty(column) || is_number(column); });
}

/// Throws InputRefused where the first line names columns with something else between them than commas.
void expect_commas(const fs::path& file, std::string_view line) {
  constexpr std::array kOthers = {std::pair{';', "semicolons"}, std::pair{'\t', "tabs"}};
  if (line.find(',') != std::string_view::npos) {
    return;
  }
  for (const auto& [separator, called] : kOthers) {
    const std::size_t at = line.find(separator);
    if (at != std::string_view::npos) {
      throw InputRefused(file, {1, static_cast<std::int64_t>(at) + 1},
                         fmt::format("{} stand between the names of the columns, not commas", called),
                         "write commas between columns, and points in numbers");
    }
  }
}

/// Says what is wrong with a line that does not hold one number per column.
[[noreturn]] void refuse_line(const fs::path& file, std::int64_t line_number, std::string_view line,
                              std::span<const ColumnName> header) {
  const auto fields = static_cast<std::size_t>(std::ranges::count(line, ',')) + 1;
  if (trimmed(line).empty()) {
    throw InputRefused(file, {line_number, 1}, "an empty line between samples", "remove it");
  }
  if (fields != header.size()) {
    const bool has_decimal_commas = fields > header.size() && line.find('.') == std::string_view::npos;
    throw InputRefused(
        file, {line_number, 1},
        fmt::format("the line has {} field{}, the header {}", fields, fields == 1 ? "" : "s", header.size()),
        has_decimal_commas ? "write numbers with decimal points, not commas" : "repair or remove the line");
  }
  const std::string terminated = std::string(line) + '\n';
  const char* p = terminated.data();
  for (const ColumnName& column : header) {
    double ignored = 0;
    const char* end = field_end(p);
    if (parse_field(p, end + 1, ignored) != end) {
      throw InputRefused(file, {line_number, p - terminated.data() + 1},
                         fmt::format("{} of column {} is not a number",
                                     in_quotes({p, static_cast<std::size_t>(end - p)}), column.name),
                         "repair the field, or leave it empty where the value is missing");
    }
    p = end + 1;
  }
  throw InputRefused(file, {line_number, 1}, "the line cannot be understood", "repair or remove the line");
}

/// Whether a last line without newline lost its end: too few fields, or a last one that is empty or no number.
bool is_cut_short(std::string_view line, std::size_t fields) {
  if (static_cast<std::size_t>(std::ranges::count(line, ',')) + 1 != fields) {
    return static_cast<std::size_t>(std::ranges::count(line, ',')) + 1 < fields;
  }
  const std::string last = std::string(line.substr(line.rfind(',') + 1)) + '\n';
  double value = 0;
  const char* end = parse_field(last.data(), last.data() + last.size(), value);
  return trimmed(last.substr(0, last.size() - 1)).empty() || end == nullptr || *end != '\n';
}

}  // namespace

Series read_csv(const fs::path& file, ChooseRules choose) { return parse_csv(TextFile(file), file, choose); }

Series parse_csv(const TextFile& content, const fs::path& file, ChooseRules choose) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  std::string_view text = content.text();
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);

  refuse_other_than_text(text, file);
  const std::size_t header_end = std::min(text.find('\n'), text.size());
  const std::string_view first_line = text.substr(0, header_end);
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw InputRefused(file, {}, "is empty", "write it again; its first line names its columns, t_s and others");
  }
  expect_commas(file, first_line);
  const std::vector<ColumnName> header = parse_header(first_line);
  if (is_row_of_numbers(header)) {
    const std::string names = header_for(file, choose, header.size());
    throw InputRefused(file, {1, 1}, "the first line holds numbers, where the names of the columns should be",
                       names.empty() ? "put a line with the names of its columns before it"
                                     : fmt::format("put this line before it: {}", names));
  }
  ColumnPlan plan = plan_columns(file, header, choose);

  Series series;
  series.file = file;
  series.name = file.filename().string();
  series.first_line = 2;
  series.columns = std::move(plan.columns);
  text.remove_prefix(std::min(header_end + 1, text.size()));

  bool cut = false;
  if (!content.ends_with_newline()) {
    const std::string_view last = text.substr(text.rfind('\n') + 1);  // npos + 1 == 0: the only line
    cut = !trimmed(last).empty() && is_cut_short(last, header.size());
    text.remove_suffix(cut ? last.size() : 0);
  }
  // Blank lines at the end are no samples.
  text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);

  const char* p = text.data();
  const char* const end = p + text.size();
  const char* const limit = content.text().data() + content.text().size() + 1;  // the closing '\n' included
  const std::size_t fields = header.size();
  const std::size_t width = series.columns.size();
  if (p < end) {
    // A little more than the first line's length promises; a wrong guess costs one more allocation.
    const auto first = static_cast<std::size_t>(std::find(p, end, '\n') - p) + 1;
    const std::size_t rows = text.size() / first + text.size() / first / 16 + 1;
    series.t_s.reserve(rows);
    series.values.reserve(rows * width);
  }
  std::vector<double> row(width);
  while (p < end) {
    check_stop();
    const char* const line = p;
    double t_s = 0;
    for (std::size_t i = 0; i < fields; ++i) {
      double value = 0;
      const int target = plan.target[i];
      const char* stop = target == ColumnPlan::kSkip ? field_end(p) : parse_field(p, limit, value);
      if (stop == nullptr || *stop != (i + 1 < fields ? ',' : '\n')) {
        const char* line_end = std::find(line, end, '\n');
        refuse_line(file, series.first_line + static_cast<std::int64_t>(series.rows()),
                    {line, static_cast<std::size_t>(line_end - line)}, header);
      }
      if (target >= 0) {
        row[static_cast<std::size_t>(target)] = value;
      } else if (target == ColumnPlan::kTime) {
        t_s = value;
      }
      p = stop + 1;
    }
    series.t_s.push_back(t_s);
    series.values.insert(series.values.end(), row.begin(), row.end());
  }
  if (cut) {
    series.cut_line = series.first_line + static_cast<std::int64_t>(series.rows());
  }
  return series;
}

void append_header(fmt::memory_buffer& out, std::span<const std::string> columns) {
  fmt::format_to(fmt::appender(out), "t_s,{}\n", fmt::join(columns, ","));
}

}  // namespace trihedron::io
