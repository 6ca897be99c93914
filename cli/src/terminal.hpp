#pragma once
/// What a stream shows text on.

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace trihedron::cli {

/// Whether it is a terminal that somebody looks at: not in a job of MPI.
[[nodiscard]] bool is_terminal(std::FILE* stream);
/// Whether it is a terminal on which the cursor can be moved: not with TERM=dumb.
[[nodiscard]] bool is_screen(std::FILE* stream);
/// The same, and NO_COLOR is not set.
[[nodiscard]] bool is_coloured(std::FILE* stream);

/// Rows and columns of a terminal; 24 × 80 where it does not say.
struct TerminalSize {
  std::size_t rows = 24;
  std::size_t columns = 80;
};
[[nodiscard]] TerminalSize size_of(std::FILE* terminal);

/// Columns that UTF-8 text takes: none of its characters is a wide one.
[[nodiscard]] std::size_t width(std::string_view text);
/// Its beginning that takes at most so many columns.
[[nodiscard]] std::string_view cut_to(std::string_view text, std::size_t columns);

}  // namespace trihedron::cli
