#pragma once
/// Standard input, output and error, whatever state the program was started with.

#include <string>

namespace trihedron::cli {

/// Puts /dev/null in the place of those of the three that are closed, so that no file that is opened later gets their
/// number and what is printed. Reading or writing one of them still fails. To be called before anything else.
void open_standard_streams();

/// Writes to standard error. Where that cannot be written there is nobody to be told so.
void say(const std::string& text);

}  // namespace trihedron::cli
