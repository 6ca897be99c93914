#pragma once

namespace trihedron::io {

/// The path by which a text file is read from standard input, whatever that is: a pipe, a terminal, a file.
inline constexpr const char* kStandardInput = "/dev/stdin";

}  // namespace trihedron::io
