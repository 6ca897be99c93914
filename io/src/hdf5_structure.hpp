#pragma once
/// What an HDF5 file may consist of before the NetCDF library is let into it: that library follows each link, and never
/// comes back from a group that holds itself.

#include <filesystem>

namespace trihedron::io {

/// Makes the HDF5 library silent, and switches off its exit handler, which crashes when a full disk has kept it from
/// closing a file; all files of ours are closed by then. To be called before anything else of HDF5 or NetCDF.
void prepare_hdf5();

/// Throws InputRefused unless the file is HDF5, a tree of groups and data with plain links, each object linked once,
/// all data within the file, and neither deep nor large beyond any pass.
void check_hdf5_structure(const std::filesystem::path& path);

}  // namespace trihedron::io
