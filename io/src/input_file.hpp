#pragma once
/// The one place where a file is opened to be read.

#include <cstddef>
#include <filesystem>

namespace trihedron::io {

/// A regular file, open for reading. Whatever else can have the name (a directory, a FIFO, a socket, a device) is
/// refused at once, because reading it could wait for ever or never end.
class InputFile {
 public:
  /// Throws InputRefused when there is no such file, it may not be read, or is no regular file; MachineFailed when it
  /// cannot be examined.
  explicit InputFile(const std::filesystem::path& path);
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  [[nodiscard]] int descriptor() const { return descriptor_; }
  /// Bytes, when it was opened.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  explicit InputFile(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  std::size_t size_ = 0;
};

/// Before a library opens a file by its name: throws InputRefused when the name is that of something else than a
/// regular file. Opens nothing: SQLite would lose its lock when another descriptor of the file is closed.
void expect_regular_file(const std::filesystem::path& path);

}  // namespace trihedron::io
