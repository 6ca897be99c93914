#pragma once
/// A whole text file in memory.

#include <filesystem>
#include <memory>
#include <string_view>

namespace trihedron::io {

/// The bytes of a file, followed by one '\n' that is not part of them: a parser needs no test for the end within a
/// line.
class TextFile {
 public:
  /// Throws as InputFile, and MachineFailed when reading fails. kStandardInput is read to its end, up to 1 GiB.
  explicit TextFile(const std::filesystem::path& path);

  [[nodiscard]] std::string_view text() const { return {bytes_.get(), size_}; }
  [[nodiscard]] bool ends_with_newline() const { return text().ends_with('\n'); }

 private:
  void read_standard_input();

  std::unique_ptr<char[]> bytes_;
  std::size_t size_ = 0;
};

/// Throws InputRefused for a text in UTF-16, as some programs of Windows write it, since what reads texts here takes
/// UTF-8; and for a file that gzip has compressed.
void refuse_other_than_text(std::string_view text, const std::filesystem::path& file);

}  // namespace trihedron::io
