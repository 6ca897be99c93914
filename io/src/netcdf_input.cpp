#include "netcdf_input.hpp"

#include <utility>

#include "netcdf_file.hpp"
#include "own_process.hpp"

namespace trihedron::io {
namespace {

void put(Sink& sink, const std::optional<std::string>& text) {
  sink.put(std::int64_t{text ? 1 : 0});
  if (text) {
    sink.put(*text);
  }
}

void put(Sink& sink, const Series& series) {
  sink.put(series.name);
  sink.put(static_cast<std::int64_t>(series.columns.size()));
  for (const std::string& column : series.columns) {
    sink.put(column);
  }
  sink.put(series.t_s);
  sink.put(series.values);
}

Series take_series(Source& source, const std::filesystem::path& file) {
  Series series;
  series.file = file;
  series.name = source.text();
  for (std::int64_t columns = source.number(); columns > 0; --columns) {
    series.columns.push_back(source.text());
  }
  series.t_s = source.numbers();
  series.values = source.numbers();
  if (series.values.size() != series.t_s.size() * series.columns.size()) {
    throw PipeEnded();
  }
  return series;
}

}  // namespace

bool NetcdfInput::has_group(const std::string& group) const {
  bool has = false;
  in_own_process(
      file_, [&](Sink& sink) { sink.put(std::int64_t{NetcdfReader(file_).has_group(group) ? 1 : 0}); },
      [&](Source& source) { has = source.number() != 0; });
  return has;
}

std::vector<std::optional<std::string>> NetcdfInput::text_attributes(const std::string& group,
                                                                     const std::vector<std::string>& names) const {
  std::vector<std::optional<std::string>> texts;
  in_own_process(
      file_,
      [&](Sink& sink) {
        const NetcdfReader reader(file_);
        for (const std::string& name : names) {
          texts.push_back(reader.text_attribute(group, name));
        }
        for (const auto& text : texts) {
          put(sink, text);
        }
      },
      [&](Source& source) {
        for (std::size_t i = 0; i < names.size(); ++i) {
          texts.push_back(source.number() != 0 ? std::optional(source.text()) : std::nullopt);
        }
      });
  return texts;
}

std::vector<std::vector<double>> NetcdfInput::read_variables(const std::vector<std::string>& paths) const {
  std::vector<std::vector<double>> columns;
  in_own_process(
      file_,
      [&](Sink& sink) {
        for (const std::vector<double>& column : NetcdfReader(file_).read_variables(paths)) {
          sink.put(column);
        }
      },
      [&](Source& source) {
        for (std::size_t i = 0; i < paths.size(); ++i) {
          columns.push_back(source.numbers());
          if (columns.back().size() != columns.front().size()) {
            throw PipeEnded();
          }
        }
      });
  return columns;
}

Series NetcdfInput::read_group(const std::string& group, Time epoch, ChooseRules choose) const {
  Series series;
  in_own_process(
      file_, [&](Sink& sink) { put(sink, NetcdfReader(file_).read_group(group, epoch, choose)); },
      [&](Source& source) { series = take_series(source, file_); });
  return series;
}

}  // namespace trihedron::io
