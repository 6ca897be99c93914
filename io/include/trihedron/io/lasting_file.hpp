#pragma once
/// Files that a program keeps up to date while it works, so that what it has confirmed outlives it whatever ends it.
/// Other than those of atomic_file.hpp they are there while they grow. The name of a directory throws UsageError, every
/// other failure MachineFailed.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "trihedron/io/descriptor.hpp"

namespace trihedron::io {

/// A file that grows at its end. A pipe or a device is written straight and cannot be carried on.
class GrowingFile {
 public:
  /// Empties the file that has the name, or makes it.
  static GrowingFile begin(const std::filesystem::path& path);
  /// Carries on after the first `size` bytes and cuts off what comes after them. Throws InputRefused where the file is
  /// not there, is shorter, or `crc` is not crc32() of them.
  static GrowingFile carry_on(const std::filesystem::path& path, std::uint64_t size, std::uint32_t crc);

  void append(std::string_view content);
  /// Returns when all of it is on the disk.
  void synchronise();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// crc32() of all of it.
  [[nodiscard]] std::uint32_t crc() const { return crc_; }

 private:
  GrowingFile(std::filesystem::path path, Descriptor file) : path_(std::move(path)), file_(std::move(file)) {}

  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;
};

/// A file of a fixed size parts of which are written again and again. Locked against other programs as long as it is
/// open.
class SlotFile {
 public:
  /// In place of the file that has the name, complete at once or not at all.
  static SlotFile begin(const std::filesystem::path& path, std::span<const std::byte> content);
  /// Throws InputRefused where it cannot be opened or is no regular file, and MachineFailed where another program has
  /// it open.
  static SlotFile open(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<std::byte>& content() const { return content_; }
  /// Writes these bytes and returns when they are on the disk.
  void put(std::size_t offset, std::span<const std::byte> bytes);

 private:
  SlotFile(std::filesystem::path path, Descriptor file, std::vector<std::byte> content)
      : path_(std::move(path)), file_(std::move(file)), content_(std::move(content)) {}

  std::filesystem::path path_;
  Descriptor file_;
  std::vector<std::byte> content_;
};

}  // namespace trihedron::io
