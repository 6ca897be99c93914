#pragma once
/// Reading by a library that does not survive every file, in a process of its own: what the library does to its memory,
/// and how it ends, harms nobody.

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace trihedron::io {

/// The end of the pipe that the other process writes to.
class Sink {
 public:
  /// `outcome` goes before the first that is put.
  Sink(int descriptor, std::int64_t outcome) : descriptor_(descriptor), outcome_(outcome) {}

  void put(std::int64_t number);
  void put(std::string_view text);
  void put(const std::vector<double>& values);
  [[nodiscard]] bool has_begun() const { return has_begun_; }

 private:
  void write(const void* data, std::size_t size) const;

  int descriptor_;
  std::int64_t outcome_;
  bool has_begun_ = false;
};

/// Thrown where the other process has ended before all was said, or says what cannot be.
class PipeEnded : public std::exception {};

/// The end that this process reads. It trusts nothing that comes: a length that is wrong ends with the pipe.
class Source {
 public:
  explicit Source(int descriptor) : descriptor_(descriptor) {}

  [[nodiscard]] std::int64_t number();
  [[nodiscard]] std::string text();
  [[nodiscard]] std::vector<double> numbers();

 private:
  template <class Container>
  [[nodiscard]] Container sequence();
  void read(void* data, std::size_t size);

  int descriptor_;
};

/// Calls `work` in a copy of this process, and `take` in this one; `work` puts what `take` gets, in the same order.
/// InputRefused and MachineFailed that `work` throws before it has put anything are thrown here. Throws InputRefused
/// where the library ends the process, or takes longer or more memory than the size of the file explains, Stopped when
/// asked to stop.
void in_own_process(const std::filesystem::path& file, const std::function<void(Sink&)>& work,
                    const std::function<void(Source&)>& take);

}  // namespace trihedron::io
