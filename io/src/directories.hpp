#pragma once
/// What files that are written all or nothing need of the file system.

#include <filesystem>
#include <string>
#include <string_view>

namespace trihedron::io {

/// Names that begin so are those of unfinished work.
inline constexpr std::string_view kHidden = ".trihedron-";

/// That holds `file`; "." for a mere name.
[[nodiscard]] std::filesystem::path directory_of(const std::filesystem::path& file);

/// What a chain of symbolic links leads to, which need not be there.
[[nodiscard]] std::filesystem::path behind_links(std::filesystem::path file);

/// "orbit.example.org"; empty where it has no name.
[[nodiscard]] std::string host_name();

/// Brings new names in a directory to the disk. Not every file system can do that, so failure is no error.
void synchronise(const std::filesystem::path& directory);

/// Removes up to `count` directories, from this one upwards, as long as they are empty.
void remove_empty(std::filesystem::path directory, int count);

}  // namespace trihedron::io
