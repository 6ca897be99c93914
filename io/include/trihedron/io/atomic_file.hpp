#pragma once
/// Files, and directories of files, that are written completely or not at all.

#include <filesystem>
#include <string_view>

namespace trihedron::io {

/// A file written under a temporary name beside its target and renamed onto it by commit(); without commit() it is
/// removed. What a killed program left under such a name is removed by the next. A target that is a symbolic link stays
/// one: the file it leads to is replaced. A file that is replaced hands its mode on. A target that is not a regular
/// file (a pipe, /dev/null) is written straight. Every failure throws MachineFailed.
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

/// Makes a directory and those above it; those that are still empty go again with the object. Throws MachineFailed.
class MadeDirectory {
 public:
  explicit MadeDirectory(std::filesystem::path directory);
  MadeDirectory(const MadeDirectory&) = delete;
  MadeDirectory& operator=(const MadeDirectory&) = delete;
  ~MadeDirectory();

 private:
  std::filesystem::path directory_;
  int made_ = 0;  ///< of it and those above
};

/// The only one that writes into a directory, as long as it lives. Throws MachineFailed, and tells who holds it.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::filesystem::path& directory);
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;
  ~DirectoryLock();

 private:
  int descriptor_ = -1;
};

/// A directory whose files appear together: they are written under path(), a hidden directory within it, and moved to
/// their places by commit(), beside what is there; without commit() nothing stays. Nobody else can stage files for the
/// same directory meanwhile. commit() first gives the hidden directory the name of a complete set: where the program is
/// killed before that the old files stay, and where it is killed later the next that stages files here finishes the
/// work. Links and modes are kept as AtomicFile keeps them. Every failure throws MachineFailed.
class StagedDirectory {
 public:
  explicit StagedDirectory(std::filesystem::path target);
  StagedDirectory(const StagedDirectory&) = delete;
  StagedDirectory& operator=(const StagedDirectory&) = delete;
  ~StagedDirectory();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  void commit();

 private:
  std::filesystem::path target_;
  MadeDirectory made_;
  DirectoryLock lock_;
  std::filesystem::path path_;
};

/// The file that a user knows of by a path that may lie in a StagedDirectory.
[[nodiscard]] std::filesystem::path unstaged(const std::filesystem::path& path);

/// One text, all or nothing.
void write_file(const std::filesystem::path& path, std::string_view content);

}  // namespace trihedron::io
