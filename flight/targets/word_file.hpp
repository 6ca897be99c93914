#pragma once
/// Binary files of words of eight bytes, least significant byte first on every processor, so that all targets read the
/// same feed and write results that can be compared byte by byte. Buffered, no heap.

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace trihedron::targets {

/// Reads a file from its beginning. After the end, or where it could not be opened, all words are zero and ok() is
/// false.
class WordReader {
 public:
  explicit WordReader(const char* path) : file_(::open(path, O_RDONLY)), ok_(file_ >= 0) {}
  ~WordReader() {
    if (file_ >= 0) {
      ::close(file_);
    }
  }
  WordReader(const WordReader&) = delete;
  WordReader& operator=(const WordReader&) = delete;

  [[nodiscard]] bool ok() const { return ok_; }

  [[nodiscard]] std::uint64_t next() {
    if (at_ == filled_) {
      fill();
    }
    if (!ok_) {
      return 0;
    }
    std::uint64_t word = 0;
    for (unsigned i = 0; i < 8; ++i) {
      word |= static_cast<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    }
    at_ += 8;
    return word;
  }

 private:
  void fill() {
    at_ = filled_ = 0;
    while (ok_ && filled_ < bytes_.size()) {
      const auto got = ::read(file_, &bytes_[filled_], bytes_.size() - filled_);
      if (got <= 0) {
        break;
      }
      filled_ += static_cast<std::size_t>(got);
    }
    ok_ = ok_ && filled_ > 0 && filled_ % 8 == 0;
  }

  int file_;
  bool ok_;
  std::size_t at_ = 0;
  std::size_t filled_ = 0;
  std::array<unsigned char, 32768> bytes_{};
};

/// Writes a new file. Complete only after close() has returned true.
class WordWriter {
 public:
  explicit WordWriter(const char* path) : file_(::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0644)), ok_(file_ >= 0) {}
  ~WordWriter() { static_cast<void>(close()); }
  WordWriter(const WordWriter&) = delete;
  WordWriter& operator=(const WordWriter&) = delete;

  void put(std::uint64_t word) {
    for (unsigned i = 0; i < 8; ++i) {
      bytes_[at_++] = static_cast<unsigned char>(word >> (8 * i));
    }
    if (at_ == bytes_.size()) {
      flush();
    }
  }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  void put(std::int64_t value) { put(static_cast<std::uint64_t>(value)); }

  /// Whether everything has been written.
  [[nodiscard]] bool close() {
    if (file_ >= 0) {
      flush();
      ok_ = ::close(file_) == 0 && ok_;
      file_ = -1;
    }
    return ok_;
  }

 private:
  void flush() {
    for (std::size_t done = 0; ok_ && done < at_;) {
      const auto written = ::write(file_, &bytes_[done], at_ - done);
      ok_ = written > 0;
      done += ok_ ? static_cast<std::size_t>(written) : 0;
    }
    at_ = 0;
  }

  int file_;
  bool ok_;
  std::size_t at_ = 0;
  std::array<unsigned char, 32768> bytes_{};
};

}  // namespace trihedron::targets
