#pragma once
/// Directories whose files are one set: the old ones or the new ones, whatever happens.

#include <filesystem>
#include <span>
#include <vector>

namespace trihedron::io {

/// Makes a directory and those above it; those that are still empty go again with the object. Throws
/// UsageError for the name of a file, MachineFailed for what else fails.
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

/// The only one that writes sets of files into a directory, as long as it lives: a lock on a hidden file that goes with
/// it. Throws MachineFailed, and tells who holds the directory.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::filesystem::path& directory);
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;
  ~DirectoryLock();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// Replaces files of a directory as a set. They are written under path(), a hidden directory within it; put_in_place()
/// moves them to their places, and keep() makes that final. Until then the destructor takes everything back, and after
/// a `kill -9` or a loss of power the next one that stages files for the same directory does: what a set replaces is
/// held in a hidden directory beside it until keep(), which only renames that one. Other files stay. Links and modes
/// are kept as AtomicFile keeps them. Throws UsageError for the name of a file; every other failure throws
/// MachineFailed.
class StagedDirectory {
 public:
  /// Refuses at once a directory that cannot be written, and one that another process stages files for.
  explicit StagedDirectory(std::filesystem::path target);
  StagedDirectory(const StagedDirectory&) = delete;
  StagedDirectory& operator=(const StagedDirectory&) = delete;
  ~StagedDirectory();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Asked before a long calculation: throws where one of these names in the directory is taken by what is no file.
  void expect_places(std::span<const std::filesystem::path> names) const;
  /// The set has no file of this name: an earlier one goes.
  void drop(const std::filesystem::path& name) { dropped_.push_back(name); }
  void put_in_place();
  void keep();
  void commit();  ///< both

 private:
  std::filesystem::path target_;
  MadeDirectory made_;
  DirectoryLock lock_;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> dropped_;
};

}  // namespace trihedron::io
