#pragma once
/// Files that are written completely or not at all.

#include <filesystem>
#include <string_view>

namespace trihedron::io {

/// A file written under a temporary name beside its target and renamed onto it by commit(); without commit() it is
/// removed. What a killed program of this machine left under such a name is removed by the next one that writes into
/// the same directory. A target that is a symbolic link stays one: the file it leads to is replaced. A file that is
/// replaced hands its mode on. A target that is not a regular file (a pipe, /dev/null) is written straight. A target
/// that is a directory throws UsageError, every other failure MachineFailed.
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
  /// Whether the target is no regular file, so that its content goes there as it is written.
  [[nodiscard]] bool straight() const { return temporary_ == target_; }
  void write(std::string_view content);
  /// Brings the content to the disk, then renames. The object must not be used afterwards.
  void commit();

 private:
  [[noreturn]] void fail(int error_number) const;

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool pending_ = true;
};

/// One text, all or nothing.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Asked before a long calculation: throws as AtomicFile where a file of this name could not even be begun. Leaves
/// nothing.
void expect_writable(const std::filesystem::path& path);

/// The file that a user knows of by a path that may lie in a StagedDirectory.
[[nodiscard]] std::filesystem::path unstaged(const std::filesystem::path& path);

}  // namespace trihedron::io
