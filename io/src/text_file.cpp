#include "text_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "input_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/standard_input.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {

void TextFile::read_standard_input() {
  constexpr std::size_t kMost = std::size_t{1} << 30U;  // more than any text that this program takes
  std::size_t capacity = std::size_t{1} << 16U;
  bytes_ = std::make_unique_for_overwrite<char[]>(capacity + 1);
  while (true) {
    check_stop();
    const ssize_t got = ::read(STDIN_FILENO, &bytes_[size_], capacity - size_);
    if (got == 0) {
      break;
    }
    if (got < 0 && errno != EINTR) {
      throw MachineFailed("standard input", fmt::format("cannot be read: {}", std::generic_category().message(errno)),
                          "check what gives it");
    }
    size_ += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    if (size_ == kMost) {
      throw InputRefused("standard input", {}, "is longer than 1 GiB", "give a text");
    }
    if (size_ == capacity) {
      capacity *= 2;
      auto larger = std::make_unique_for_overwrite<char[]>(capacity + 1);
      std::copy_n(bytes_.get(), size_, larger.get());
      bytes_ = std::move(larger);
    }
  }
  bytes_[size_] = '\n';
}

TextFile::TextFile(const std::filesystem::path& path) {
  if (path == kStandardInput) {
    read_standard_input();
    return;
  }
  const InputFile file(path);
  const std::size_t expected = file.size();
  // Read, not memory-mapped: if another program truncates a mapped file, access ends this one by a signal.
  bytes_ = std::make_unique_for_overwrite<char[]>(expected + 1);
  while (size_ < expected) {
    check_stop();
    const ssize_t got = ::read(file.descriptor(), &bytes_[size_], expected - size_);
    if (got == 0) {
      break;
    }
    if (got > 0) {
      size_ += static_cast<std::size_t>(got);
    } else if (errno != EINTR) {
      throw MachineFailed(path, fmt::format("cannot be read: {}", std::generic_category().message(errno)),
                          "check the disk");
    }
  }
  bytes_[size_] = '\n';
}

void refuse_other_than_text(std::string_view text, const std::filesystem::path& file) {
  if (text.starts_with("\x1F\x8B")) {
    throw InputRefused(file, {1, 1}, "is compressed", "unpack it: gunzip");
  }
  const bool has_mark = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  // Without a mark: every other octet of ASCII is zero.
  const bool is_wide = text.size() > 1 && (text[0] == '\0') != (text[1] == '\0');
  if (has_mark || is_wide) {
    throw InputRefused(file, {1, 1}, "is UTF-16, and texts here are UTF-8",
                       "convert it: iconv -f UTF-16 -t UTF-8, or save it again as UTF-8");
  }
}

}  // namespace trihedron::io
