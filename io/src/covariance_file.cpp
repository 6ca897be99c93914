#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netcdf.h>

#include <string>
#include <vector>

#include "acm_keywords.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/calibration_message.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io {

void write_covariance(const std::filesystem::path& path, const Calibration& calibration) {
  AtomicFile file(path);
  const auto check = [&](int status) {
    if (status != NC_NOERR) {
      throw MachineFailed(unstaged(path), fmt::format("cannot be written: {}", nc_strerror(status)),
                          "free some space, or choose another place");
    }
  };
  const std::size_t n = calibration.states.size();
  std::vector<std::string> names;
  std::vector<const char*> name_pointers;
  std::vector<const char*> units;
  for (const ParameterId& state : calibration.states) {
    names.push_back(name_of(state));
    units.push_back(state.is_drift() ? "rad s-1" : "rad");
  }
  for (const std::string& name : names) {
    name_pointers.push_back(name.c_str());
  }
  int id = -1;
  check(nc_create(std::filesystem::absolute(file.temporary()).c_str(), NC_NETCDF4, &id));
  struct Closer {
    int id;
    ~Closer() {
      if (id >= 0) {
        nc_close(id);
      }
    }
  } closer{id};
  int rows = -1;
  int columns = -1;
  int covariance = -1;
  int state = -1;
  int unit = -1;
  check(nc_def_dim(id, "state", n, &rows));
  check(nc_def_dim(id, "state_2", n, &columns));
  const int dimensions[] = {rows, columns};
  check(nc_def_var(id, "covariance", NC_DOUBLE, 2, dimensions, &covariance));
  check(nc_def_var(id, "state", NC_STRING, 1, &rows, &state));
  check(nc_def_var(id, "units", NC_STRING, 1, &rows, &unit));
  const auto attribute = [&](int variable, const char* name, const std::string& text) {
    check(nc_put_att_text(id, variable, name, text.size(), text.c_str()));
  };
  attribute(NC_GLOBAL, "title", "Covariance of a calibration of electrostatic gyros, as in calibration.json");
  attribute(NC_GLOBAL, "epoch_tai", format_epoch(calibration.t));
  attribute(NC_GLOBAL, kCovarianceStates, fmt::format("{}", fmt::join(names, " ")));
  attribute(covariance, "long_name", "covariance of the errors, estimate - truth; alignments about c x, y, z");
  check(nc_enddef(id));
  if (n > 0) {
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> by_rows = calibration.covariance;
    check(nc_put_var_double(id, covariance, by_rows.data()));
    check(nc_put_var_string(id, state, name_pointers.data()));
    check(nc_put_var_string(id, unit, units.data()));
  }
  closer.id = -1;
  check(nc_close(id));
  file.commit();
}

}  // namespace trihedron::io
