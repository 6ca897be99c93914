#pragma once
/// What the targets have in common. A target defines read(), which is given the bytes of a file.

#include <filesystem>
#include <span>
#include <string_view>

namespace trihedron::fuzz {

/// Reads a file of this content. May throw io::InputRefused and nothing else.
void read(std::string_view bytes);

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
