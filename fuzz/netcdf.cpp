// A NetCDF file of any bytes.
#include "target.hpp"
#include "trihedron/io/pass.hpp"

void trihedron::fuzz::read_netcdf(std::string_view bytes) {
  const MemoryFile file(bytes);
  static_cast<void>(io::read_pass(file.path()));
  static_cast<void>(io::read_truth(file.path()));
}
