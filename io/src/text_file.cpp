#include "text_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "input_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {

TextFile::TextFile(const std::filesystem::path& path) {
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

}  // namespace trihedron::io
