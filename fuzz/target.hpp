#pragma once
/// The targets, and what they have in common. All are in one program, which has a name for each: fuzz_csv and so on.

#include <filesystem>
#include <span>
#include <string_view>

#include "trihedron/io/error.hpp"

namespace trihedron::fuzz {

// Each reads a file of this content. May throw io::InputRefused and nothing else.
void read_attitude(std::string_view bytes);
void read_attitude_message(std::string_view bytes);
void read_c_kernel(std::string_view bytes);
void read_calibration(std::string_view bytes);
void read_catalogue(std::string_view bytes);
void read_catalogue_sql(std::string_view bytes);
void read_csv(std::string_view bytes);
void read_netcdf(std::string_view bytes);
void read_netcdf_layout(std::string_view bytes);
void read_orbit_message(std::string_view bytes);
void read_packets(std::string_view bytes);
void read_pass_toml(std::string_view bytes);
void read_scenario(std::string_view bytes);
void read_settings(std::string_view bytes);
void read_telemetry(std::string_view bytes);
void read_truth(std::string_view bytes);

/// Whether there is what `work` reads is for the input to say.
template <class Work>
void unless_refused(const Work& work) {
  try {
    work();
  } catch (const io::InputRefused&) {
  }
}

/// A file in memory; it is gone with the object.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes);
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile();

  [[nodiscard]] std::filesystem::path path() const;

 private:
  int descriptor_;
};

/// A file in a directory of its own, for libraries that put others beside it; both are gone with the object.
class DirectoryFile {
 public:
  explicit DirectoryFile(std::string_view bytes);
  DirectoryFile(const DirectoryFile&) = delete;
  DirectoryFile& operator=(const DirectoryFile&) = delete;
  ~DirectoryFile();

  [[nodiscard]] std::filesystem::path path() const { return directory_ / "input"; }
  [[nodiscard]] const std::filesystem::path& directory() const { return directory_; }

 private:
  std::filesystem::path directory_;
};

/// Ends the process with a report where the condition does not hold.
void expect(bool condition, const char* what);

}  // namespace trihedron::fuzz
