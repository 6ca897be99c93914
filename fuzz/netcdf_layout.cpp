// A NetCDF file that the library has written, of groups, dimensions, types and attributes that the input chooses.
#include <fuzzer/FuzzedDataProvider.h>
#include <netcdf.h>

#include <array>
#include <string>
#include <vector>

#include "fixtures.hpp"
#include "netcdf_file.hpp"
#include "target.hpp"

namespace {

constexpr std::array kTypes = {NC_DOUBLE, NC_FLOAT, NC_INT, NC_INT64, NC_UINT64, NC_BYTE, NC_CHAR, NC_STRING, NC_SHORT};
constexpr std::array kNames = {
    "t_s",  "h1_x",      "h1_y",         "h1_z",       "h2_x",       "h2_y",  "h2_z",           "h3_x",   "time",
    "gyro", "pass_toml", "prior_json",   "truth_json", "units",      "truth", "star_tracker",   "q_x",    "q_y",
    "q_z",  "q_w",       "scale_factor", "add_offset", "_FillValue", "x",     "star_tracker_2", "comment"};
constexpr std::array kTexts = {
    "1", "degree", "seconds", "seconds since 2009-05-20", "seconds since 2009-05-20T00:00:00", "", "nan"};

class Writer {
 public:
  Writer(const std::filesystem::path& file, FuzzedDataProvider& input) : input_(input) {
    trihedron::fuzz::expect(nc_create(file.c_str(), NC_NETCDF4 | NC_CLOBBER, &id_) == NC_NOERR, "a file to write");
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { nc_close(id_); }

  /// Errors are ignored: what cannot be written is left out.
  void write() {
    if (input_.ConsumeBool()) {
      const std::string toml = trihedron::io::clean_pass().toml;
      nc_put_att_text(id_, NC_GLOBAL, "pass_toml", toml.size(), toml.c_str());
    }
    attributes(id_, NC_GLOBAL);
    for (int groups = input_.ConsumeIntegralInRange(0, 5); groups > 0; --groups) {
      int group = 0;
      if (nc_def_grp(id_, name(), &group) == NC_NOERR) {
        fill(group);
      }
    }
  }

 private:
  const char* name() { return input_.PickValueInArray(kNames); }

  void fill(int group) {
    constexpr std::size_t kLongest = 200;
    std::vector<int> dimensions;
    for (int count = input_.ConsumeIntegralInRange(0, 3); count > 0; --count) {
      int dimension = 0;
      const std::size_t length = input_.ConsumeIntegralInRange<std::size_t>(0, kLongest);
      if (nc_def_dim(group, input_.ConsumeProbability<float>() < 0.7F ? "time" : name(), length, &dimension) ==
          NC_NOERR) {
        dimensions.push_back(dimension);
      }
    }
    if (input_.ConsumeBool()) {
      for (const char* column : {"t_s", "h1_x", "h1_y", "h1_z", "h2_x", "h2_y", "h2_z"}) {
        variable(group, column, dimensions);
      }
    }
    for (int variables = input_.ConsumeIntegralInRange(0, 9); variables > 0; --variables) {
      variable(group, name(), dimensions);
    }
    attributes(group, NC_GLOBAL);
  }

  void variable(int group, const char* variable_name, const std::vector<int>& dimensions) {
    std::array<int, 3> along{};
    int rank = input_.ConsumeProbability<float>() < 0.8F ? 1 : input_.ConsumeIntegralInRange(0, 3);
    for (int i = 0; i < rank; ++i) {
      if (dimensions.empty()) {
        rank = 0;
        break;
      }
      along[static_cast<std::size_t>(i)] =
          dimensions[input_.ConsumeIntegralInRange<std::size_t>(0, dimensions.size() - 1)];
    }
    const nc_type type = input_.ConsumeProbability<float>() < 0.7F ? NC_DOUBLE : input_.PickValueInArray(kTypes);
    int id = 0;
    if (nc_def_var(group, variable_name, type, rank, along.data(), &id) != NC_NOERR) {
      return;
    }
    attributes(group, id);
    std::size_t start = 0;
    for (int values = input_.ConsumeIntegralInRange(0, 4); values > 0 && rank == 1 && type != NC_STRING; --values) {
      const double value = input_.ConsumeFloatingPoint<double>();
      nc_put_var1_double(group, id, &start, &value);
      ++start;
    }
  }

  void attributes(int group, int variable) {
    for (int count = input_.ConsumeIntegralInRange(0, 3); count > 0; --count) {
      const char* const attribute = name();
      if (input_.ConsumeBool()) {
        const double value = input_.ConsumeFloatingPoint<double>();
        nc_put_att_double(group, variable, attribute, input_.PickValueInArray(kTypes),
                          input_.ConsumeIntegralInRange<std::size_t>(0, 1), &value);
      } else if (input_.ConsumeBool()) {
        const std::string text =
            input_.ConsumeBool() ? input_.PickValueInArray(kTexts) : input_.ConsumeRandomLengthString(80);
        nc_put_att_text(group, variable, attribute, text.size(), text.c_str());
      } else {
        const std::string text = input_.ConsumeRandomLengthString(80);
        std::array<const char*, 2> texts = {text.c_str(), nullptr};
        nc_put_att_string(group, variable, attribute, input_.ConsumeIntegralInRange<std::size_t>(0, 2), texts.data());
      }
    }
  }

  FuzzedDataProvider& input_;
  int id_ = 0;
};

}  // namespace

void trihedron::fuzz::read_netcdf_layout(std::string_view bytes) {
  const DirectoryFile file("");
  FuzzedDataProvider input(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  { Writer(file.path(), input).write(); }
  const io::NetcdfReader reader(file.path());
  const Time epoch = io::sample_calibration().epoch;
  for (const char* attribute : {"pass_toml", "prior_json", "comment"}) {
    unless_refused([&] { static_cast<void>(reader.text_attribute("", attribute)); });
  }
  unless_refused([&] { static_cast<void>(reader.read_group("gyro", epoch, io::gyro_columns)); });
  unless_refused([&] { static_cast<void>(reader.read_group("star_tracker", epoch, io::star_tracker_columns)); });
  if (reader.has_group("truth")) {
    unless_refused([&] { static_cast<void>(reader.text_attribute("truth", "truth_json")); });
    unless_refused([&] { static_cast<void>(reader.read_group("truth", epoch, io::truth_columns)); });
  }
}
