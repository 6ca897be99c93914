// In place of netcdf_input.cpp and netcdf_file.cpp where the library is not there.
#include <utility>

#include "netcdf_file.hpp"
#include "netcdf_input.hpp"

namespace trihedron::io {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw InputRefused(file, {}, "is read or written as NetCDF, which this build of the library leaves to others",
                     "in Python, open and save it with xarray: trihedron.read_pass() and Pass.to_netcdf() do");
}

}  // namespace

bool NetcdfInput::has_group(const std::string& /*group*/) const { refuse(file_); }
std::vector<std::optional<std::string>> NetcdfInput::text_attributes(const std::string& /*group*/,
                                                                     const std::vector<std::string>& /*names*/) const {
  refuse(file_);
}
std::vector<std::vector<double>> NetcdfInput::read_variables(const std::vector<std::string>& /*paths*/) const {
  refuse(file_);
}
Series NetcdfInput::read_group(const std::string& /*group*/, Time /*epoch*/, ChooseRules /*choose*/) const {
  refuse(file_);
}

NetcdfWriter::NetcdfWriter(const std::filesystem::path& path) : path_(path), file_(path) { refuse(path); }
NetcdfWriter::~NetcdfWriter() = default;
// No object is ever made, so that the others have nothing to do.
void NetcdfWriter::write_attribute(const std::string& /*group*/, const std::string& /*name*/,
                                   const std::string& /*text*/) {}
void NetcdfWriter::write_group(const std::string& /*group*/, Time /*epoch*/, std::span<const Time> /*t*/,
                               std::span<const PackedColumn> /*columns*/) {}
void NetcdfWriter::commit() {}

}  // namespace trihedron::io
