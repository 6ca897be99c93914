#pragma once
/// Files that are written completely or not at all.

#include <filesystem>
#include <string_view>

namespace trihedron::io {

/// A file written under a temporary name beside its target and renamed onto it by commit(); without commit() it is
/// removed. A target that is not a regular file (a pipe, /dev/null) is written straight. Every failure throws
/// MachineFailed.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path target);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// The name to write under, for a library that opens the file itself; the target where that is written straight.
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  void write(std::string_view content);
  /// Brings the content to the disk, then renames. The object must not be used afterwards.
  void commit();

 private:
  [[nodiscard]] bool straight() const { return temporary_ == target_; }
  [[noreturn]] void fail(int error_number) const;

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool pending_ = true;
};

/// Makes the directory and those above it; true when it was not there. Throws MachineFailed.
bool make_directory(const std::filesystem::path& directory);

/// One text, all or nothing.
void write_file(const std::filesystem::path& path, std::string_view content);

}  // namespace trihedron::io
