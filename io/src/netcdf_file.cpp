#include "netcdf_file.hpp"

#include <H5Fpublic.h>
#include <H5Ipublic.h>
#include <fmt/format.h>
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <utility>

#include "hdf5_structure.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr std::int32_t kPackedFill = std::numeric_limits<std::int32_t>::min();
constexpr const char* kLayoutCure = "write it as `trihedron simulate` does";

/// Whether every value can be packed: NaN can, infinity and outliers beyond 32 bits cannot and must not be lost.
bool fits(const std::vector<double>& values, double lsb) {
  const double limit = lsb * std::numeric_limits<std::int32_t>::max();
  return lsb > 0 && std::ranges::all_of(values, [=](double v) { return std::isnan(v) || std::abs(v) <= limit; });
}

/// Whether deflating packed values is worth its time. Where the lower half of the bits is noise or motion, as in
/// telemetry at 8 Hz in fine steps, it takes twice as long as all the rest of writing, for a third of the size.
bool worth_deflating(const std::vector<double>& values, double lsb) {
  constexpr std::size_t kFew = 16384;
  constexpr double kSteps = 4096;
  if (values.size() < kFew) {
    return true;
  }
  double change = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    change += std::isnan(step) ? 0 : step;
  }
  return change < kSteps * lsb * static_cast<double>(values.size());
}

/// nc_close() crashes where HDF5 cannot write the last of a file. So HDF5 is kept from closing it there, and told to
/// afterwards.
int close_written(int id) {
  hid_t file = H5I_INVALID_HID;
  const bool is_held = H5Fget_obj_ids(H5F_OBJ_ALL, H5F_OBJ_FILE, 1, &file) == 1 && H5Iinc_ref(file) > 1;
  const int status = nc_close(id);
  return is_held && H5Fclose(file) < 0 ? NC_EHDFERR : status;
}

}  // namespace

NetcdfReader::NetcdfReader(fs::path file) : file_(std::move(file)) {
  check_hdf5_structure(file_);
  // Absolute, because the library takes a name with "://" for a web address.
  const int status = nc_open(fs::absolute(file_).c_str(), NC_NOWRITE, &id_);
  if (status != NC_NOERR) {
    refuse(fmt::format("is no NetCDF-4 file that can be read ({})", nc_strerror(status)), kGiveAPass);
  }
}

NetcdfReader::~NetcdfReader() { nc_close(id_); }

void NetcdfReader::refuse(std::string reason, std::string cure) const {
  throw InputRefused(file_, {}, std::move(reason), std::move(cure));
}

void NetcdfReader::check(int status, const std::string& doing) const {
  if (status != NC_NOERR) {
    refuse(fmt::format("{} failed ({})", doing, nc_strerror(status)), "the file is damaged: get it again");
  }
}

bool NetcdfReader::has_group(const std::string& group) const {
  int id = 0;
  // A file of the classic format, which has no groups, answers with itself.
  return nc_inq_ncid(id_, group.c_str(), &id) == NC_NOERR && id != id_;
}

int NetcdfReader::group_id(const std::string& group) const {
  if (group.empty()) {
    return id_;
  }
  if (!has_group(group)) {
    refuse(fmt::format("lacks group {}", in_quotes(group)), kLayoutCure);
  }
  int id = 0;
  check(nc_inq_ncid(id_, group.c_str(), &id), "opening a group");
  return id;
}

std::optional<std::string> NetcdfReader::text_attribute(const std::string& group, const std::string& name) const {
  return text_attribute(group_id(group), NC_GLOBAL, name.c_str());
}

std::optional<std::string> NetcdfReader::text_attribute(int group, int variable, const char* name) const {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(group, variable, name, &type, &length) != NC_NOERR) {
    return std::nullopt;
  }
  if (type == NC_STRING && length == 1) {  // as h5netcdf writes text
    char* text = nullptr;
    check(nc_get_att_string(group, variable, name, &text), fmt::format("reading attribute {}", in_quotes(name)));
    std::string result(text == nullptr ? "" : text);  // HDF5 has strings that are nothing
    nc_free_string(1, &text);
    return result;
  }
  if (type != NC_CHAR) {
    refuse(fmt::format("attribute {} is not text", in_quotes(name)), kLayoutCure);
  }
  std::string result(length, '\0');
  check(nc_get_att_text(group, variable, name, result.data()), fmt::format("reading attribute {}", in_quotes(name)));
  return result;
}

std::optional<double> NetcdfReader::number_attribute(int group, int variable, const char* name) const {
  std::size_t length = 0;
  double value = 0;
  if (nc_inq_attlen(group, variable, name, &length) != NC_NOERR) {
    return std::nullopt;
  }
  if (length != 1 || nc_get_att_double(group, variable, name, &value) != NC_NOERR) {
    refuse(fmt::format("attribute {} is not a number", in_quotes(name)), kLayoutCure);
  }
  return value;
}

void NetcdfReader::check_time_units(const std::string& group, int id, int variable, Time epoch) const {
  const std::string units = text_attribute(id, variable, "units").value_or("seconds");
  constexpr std::string_view kSeconds = "seconds";
  constexpr std::string_view kSince = "seconds since ";
  std::string since = units.starts_with(kSince) ? units.substr(kSince.size()) : "";
  std::ranges::replace(since, ' ', 'T');
  // A bare date is how xarray writes a midnight.
  const std::optional<Time> named = parse_epoch(since.size() == 10 ? since + "T00:00:00" : since);
  if (units != kSeconds && named != epoch) {
    refuse(fmt::format("group {}: t_s has units {}", in_quotes(group), in_quotes(units)),
           fmt::format("they must be \"seconds since {}\", the epoch of the pass", format_epoch(epoch)));
  }
}

void NetcdfReader::check_units(const std::string& group, int id, int variable, const std::string& name) const {
  const std::optional<std::string> units = text_attribute(id, variable, "units");
  const bool is_covariance = std::ranges::count(covariance_names(), name) > 0;
  if (units && *units != (is_covariance ? "rad2" : "1") && !units->empty()) {
    refuse(fmt::format("group {}: {} has units {}", in_quotes(group), name, in_quotes(*units)),
           is_covariance ? "convert the values to rad², and give units \"rad2\""
                         : "direction cosines and quaternions have none: convert the values, and give units \"1\"");
  }
}

void NetcdfReader::read_column(int id, int variable, std::vector<double>& values) const {
  check(nc_get_var_double(id, variable, values.data()), "reading a variable");
  unpack(id, variable, values);
}

void NetcdfReader::unpack(int id, int variable, std::vector<double>& values) const {
  const double scale = number_attribute(id, variable, "scale_factor").value_or(1);
  const double offset = number_attribute(id, variable, "add_offset").value_or(0);
  const std::optional<double> fill = number_attribute(id, variable, "_FillValue");
  for (double& value : values) {
    value = value == fill ? std::numeric_limits<double>::quiet_NaN() : value * scale + offset;
  }
}

void NetcdfReader::check_rows(const std::string& group, int id, std::span<const int> variables,
                              std::size_t rows) const {
  constexpr double kMostCompressed = 1100;  // deflate makes one byte of 1032 at most
  std::size_t row_bytes = 0;
  for (const int variable : variables) {
    nc_type type = NC_NAT;
    std::size_t bytes = 0;
    check(nc_inq_vartype(id, variable, &type), "reading a type");
    check(nc_inq_type(id, type, nullptr, &bytes), "reading a type");
    row_bytes += bytes;
  }
  const std::uintmax_t held = fs::file_size(file_);
  if (static_cast<double>(rows) * static_cast<double>(row_bytes) > kMostCompressed * static_cast<double>(held)) {
    refuse(
        fmt::format("group {} declares {} rows, more than a file of {} bytes can hold", in_quotes(group), rows, held),
        "write the rows that there are; those that were declared and never written are no telemetry");
  }
}

Series NetcdfReader::read_group(const std::string& group, Time epoch, ChooseRules choose) const {
  const int id = group_id(group);
  int dimension = 0;
  std::size_t rows = 0;
  if (nc_inq_dimid(id, kTimeDimension, &dimension) != NC_NOERR || nc_inq_dimlen(id, dimension, &rows) != NC_NOERR) {
    refuse(fmt::format("group {} lacks dimension \"time\"", in_quotes(group)), kLayoutCure);
  }
  int variables = 0;
  check(nc_inq_nvars(id, &variables), "listing the variables");
  std::vector<ColumnName> present;
  std::vector<int> ids;
  for (int variable = 0; variable < variables; ++variable) {
    std::array<char, NC_MAX_NAME + 1> name{};
    check(nc_inq_varname(id, variable, name.data()), "listing the variables");
    if (std::string_view(name.data()) != kTimeDimension) {  // a coordinate that other tools may add
      present.push_back({name.data(), {}});
      ids.push_back(variable);
    }
  }

  Series series;
  series.file = file_;
  series.name = "group " + group;
  ColumnPlan plan = plan_columns(fs::path(file_.string() + ":" + group), present, choose);
  series.columns = std::move(plan.columns);
  const std::size_t width = series.columns.size();
  check_rows(group, id, ids, rows);
  series.t_s.resize(rows);
  series.values.resize(rows * width);
  std::vector<double> column(rows);
  for (std::size_t i = 0; i < present.size(); ++i) {
    check_stop();
    int dimensions = 0;
    int first = -1;
    nc_type type = NC_NAT;
    check(nc_inq_varndims(id, ids[i], &dimensions), "reading the dimensions");
    if (dimensions == 1) {
      check(nc_inq_vardimid(id, ids[i], &first), "reading the dimensions");
    }
    if (first != dimension) {
      refuse(fmt::format("group {}: variable {} is not along dimension \"time\" alone", in_quotes(group),
                         in_quotes(present[i].name)),
             kLayoutCure);
    }
    check(nc_inq_vartype(id, ids[i], &type), "reading a type");
    if (type == NC_CHAR || type >= NC_STRING) {
      refuse(fmt::format("group {}: variable {} does not hold numbers", in_quotes(group), in_quotes(present[i].name)),
             kLayoutCure);
    }
    if (plan.target[i] == ColumnPlan::kSkip) {
      continue;
    }
    read_column(id, ids[i], column);
    if (plan.target[i] == ColumnPlan::kTime) {
      check_time_units(group, id, ids[i], epoch);
      series.t_s = column;
    } else {
      check_units(group, id, ids[i], present[i].name);
      for (std::size_t row = 0; row < rows; ++row) {
        series.values[row * width + static_cast<std::size_t>(plan.target[i])] = column[row];
      }
    }
  }
  return series;
}

std::vector<std::vector<double>> NetcdfReader::read_variables(std::span<const std::string> paths) const {
  std::vector<std::vector<double>> columns;
  for (const std::string& path : paths) {
    check_stop();
    const std::size_t bracket = path.ends_with(']') ? path.rfind('[') : std::string::npos;
    const std::size_t slash = path.rfind('/', bracket);
    const std::string group = slash == std::string::npos ? "" : path.substr(0, slash);
    const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
    const std::string name = path.substr(begin, bracket == std::string::npos ? bracket : bracket - begin);
    const int id = group_id(group);
    int variable = 0;
    if (nc_inq_varid(id, name.c_str(), &variable) != NC_NOERR) {
      refuse(fmt::format("lacks variable {}", in_quotes(path)), "name one that ncdump -h shows, as GROUP/NAME");
    }
    std::array<int, 2> dimensions{};
    std::array<std::size_t, 2> length{0, 1};
    int count = 0;
    nc_type type = NC_NAT;
    check(nc_inq_varndims(id, variable, &count), "reading the dimensions");
    check(nc_inq_vartype(id, variable, &type), "reading a type");
    const int expected = bracket == std::string::npos ? 1 : 2;
    if (count != expected) {
      refuse(fmt::format("variable {} has {} dimension{}, not {}", in_quotes(path), count, count == 1 ? "" : "s",
                         expected),
             "a column has one; name column 0 of a variable with two as NAME[0]");
    }
    if (type == NC_CHAR || type >= NC_STRING) {
      refuse(fmt::format("variable {} does not hold numbers", in_quotes(path)), "name one of numbers");
    }
    check(nc_inq_vardimid(id, variable, dimensions.data()), "reading the dimensions");
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      check(nc_inq_dimlen(id, dimensions[i], &length[i]), "reading the dimensions");
    }
    std::array<std::size_t, 2> start{0, 0};
    if (count == 2) {
      const char* const first = path.data() + bracket + 1;
      const char* const last = path.data() + path.size() - 1;
      const auto [end, fault] = std::from_chars(first, last, start[1]);
      if (fault != std::errc() || end != last || start[1] >= length[1]) {
        refuse(fmt::format("variable {} has no such column", in_quotes(path)),
               fmt::format("it has {} of them, counted from 0", length[1]));
      }
    }
    const int checked = variable;
    check_rows(group, id, {&checked, 1}, length[0]);
    if (!columns.empty() && columns.front().size() != length[0]) {
      refuse(fmt::format("variable {} has {} rows, {} has {}", in_quotes(path), length[0], in_quotes(paths.front()),
                         columns.front().size()),
             "the columns of a table must have the same length");
    }
    std::vector<double>& column = columns.emplace_back(length[0]);
    const std::array<std::size_t, 2> rows{length[0], 1};
    check(nc_get_vara_double(id, variable, start.data(), rows.data(), column.data()), "reading a variable");
    unpack(id, variable, column);
  }
  return columns;
}

NetcdfWriter::NetcdfWriter(const fs::path& path) : path_(path), file_(path) {
  prepare_hdf5();
  if (file_.straight()) {
    throw MachineFailed(path, "is no regular file", "give the name of a file on a disk: NetCDF needs one");
  }
  check(nc_create(fs::absolute(file_.temporary()).c_str(), NC_NETCDF4, &id_));
}

NetcdfWriter::~NetcdfWriter() {
  if (id_ >= 0) {
    close_written(id_);
  }
}

void NetcdfWriter::check(int status) const {
  if (status != NC_NOERR) {
    throw MachineFailed(unstaged(path_), fmt::format("cannot be written: {}", nc_strerror(status)),
                        "check that the directory may be written and that the disk has room");
  }
}

int NetcdfWriter::group_id(const std::string& group) {
  int id = id_;
  if (!group.empty() && nc_inq_ncid(id_, group.c_str(), &id) != NC_NOERR) {
    check(nc_def_grp(id_, group.c_str(), &id));
  }
  return id;
}

void NetcdfWriter::write_attribute(const std::string& group, const std::string& name, const std::string& text) {
  check(nc_put_att_text(group_id(group), NC_GLOBAL, name.c_str(), text.size(), text.c_str()));
}

int NetcdfWriter::define(int group, int dimension, const Column& column, bool packed, double lsb) const {
  constexpr int kShuffle = 1;
  constexpr int kDeflate = 1;
  constexpr int kDeflateLevel = 1;
  int variable = 0;
  check(nc_def_var(group, column.name.c_str(), packed ? NC_INT : NC_DOUBLE, 1, &dimension, &variable));
  if (!packed || worth_deflating(column.values, lsb)) {
    check(nc_def_var_deflate(group, variable, kShuffle, kDeflate, kDeflateLevel));
  }
  check(nc_put_att_text(group, variable, "units", column.units.size(), column.units.c_str()));
  check(nc_put_att_text(group, variable, "long_name", column.long_name.size(), column.long_name.c_str()));
  if (packed) {
    check(nc_def_var_fill(group, variable, NC_FILL, &kPackedFill));
    check(nc_put_att_double(group, variable, "scale_factor", NC_DOUBLE, 1, &lsb));
  }
  return variable;
}

void NetcdfWriter::write_group(const std::string& group, Time epoch, std::span<const Time> t,
                               std::span<const PackedColumn> columns) {
  const int id = group_id(group);
  int dimension = 0;
  check(nc_def_dim(id, kTimeDimension, t.size(), &dimension));

  Column time{kTimeColumn, "seconds since " + format_epoch(epoch), "time since the epoch of the pass", {}};
  std::ranges::transform(t, std::back_inserter(time.values), [&](Time at) { return to_seconds(at - epoch); });
  constexpr std::string_view kStandardName = "time";
  constexpr std::string_view kComment = "time scale TAI: every second is counted, there are no leap seconds";
  const int time_variable = define(id, dimension, time, false, 0);
  check(nc_put_att_text(id, time_variable, "standard_name", kStandardName.size(), kStandardName.data()));
  check(nc_put_att_text(id, time_variable, "comment", kComment.size(), kComment.data()));
  check(nc_put_var_double(id, time_variable, time.values.data()));

  for (const PackedColumn& column : columns) {
    check_stop();
    const bool packed = fits(column.values, column.lsb);
    const int variable = define(id, dimension, column, packed, column.lsb);
    check(nc_put_att_text(id, variable, "coordinates", 3, kTimeColumn));
    if (packed) {
      std::vector<std::int32_t> values(column.values.size());
      std::ranges::transform(column.values, values.begin(), [&](double v) {
        return std::isnan(v) ? kPackedFill : static_cast<std::int32_t>(std::lround(v / column.lsb));
      });
      check(nc_put_var_int(id, variable, values.data()));
    } else {
      check(nc_put_var_double(id, variable, column.values.data()));
    }
  }
}

void NetcdfWriter::write_variables(std::span<const std::pair<std::string, std::size_t>> dimensions,
                                   std::span<const ShapedVariable> variables) {
  for (const auto& [name, length] : dimensions) {
    int dimension = 0;
    check(nc_def_dim(id_, name.c_str(), length, &dimension));
  }
  for (const ShapedVariable& variable : variables) {
    check_stop();
    std::vector<int> ids;
    for (const std::string& dimension : variable.dimensions) {
      check(nc_inq_dimid(id_, dimension.c_str(), &ids.emplace_back()));
    }
    constexpr std::array<nc_type, 3> kTypes = {NC_DOUBLE, NC_INT64, NC_STRING};
    int id = 0;
    check(nc_def_var(id_, variable.name.c_str(), kTypes[variable.values.index()], static_cast<int>(ids.size()),
                     ids.data(), &id));
    for (const auto& [name, text] : variable.attributes) {
      if (name == "flag_values") {
        std::vector<long long> flags;
        std::istringstream words(text);
        for (long long flag = 0; words >> flag; words.ignore()) {
          flags.push_back(flag);
        }
        check(nc_put_att_longlong(id_, id, name.c_str(), NC_INT64, flags.size(), flags.data()));
      } else {
        check(nc_put_att_text(id_, id, name.c_str(), text.size(), text.c_str()));
      }
    }
    if (const auto* numbers = std::get_if<std::vector<double>>(&variable.values)) {
      check(nc_put_var_double(id_, id, numbers->data()));
    } else if (const auto* whole = std::get_if<std::vector<std::int64_t>>(&variable.values)) {
      const std::vector<long long> values(whole->begin(), whole->end());
      check(nc_put_var_longlong(id_, id, values.data()));
    } else if (const auto* texts = std::get_if<std::vector<std::string>>(&variable.values)) {
      std::vector<const char*> values;
      for (const std::string& text : *texts) {
        values.push_back(text.c_str());
      }
      check(nc_put_var_string(id_, id, values.data()));
    }
  }
}

void NetcdfWriter::commit() {
  check(close_written(std::exchange(id_, -1)));
  file_.commit();
}

}  // namespace trihedron::io
