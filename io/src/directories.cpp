#include "directories.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <system_error>

namespace trihedron::io {
namespace fs = std::filesystem;

fs::path directory_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

fs::path behind_links(fs::path file) {
  constexpr int kMostLinks = 40;  // as Linux has it
  std::error_code fault;
  for (int link = 0; link < kMostLinks && fs::is_symlink(fs::symlink_status(file, fault)); ++link) {
    file = directory_of(file) / fs::read_symlink(file, fault);
  }
  return file;
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

void synchronise(const fs::path& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
}

void remove_empty(fs::path directory, int count) {
  std::error_code fault;
  directory = directory.has_filename() ? directory : directory.parent_path();
  for (; count > 0 && (fs::remove(directory, fault), !fault); --count) {
    directory = directory.parent_path();
  }
}

}  // namespace trihedron::io
