#pragma once
/// What a command writes must not be what it reads.

#include <filesystem>
#include <span>

namespace trihedron::io {

/// Throws UsageError where an output is one of the inputs, by whatever name (symbolic and hard links are followed), or
/// lies in an input that is a directory. Neither has to be there, and an empty path is none. What is written to a
/// device or a pipe replaces nothing and is let through.
void expect_apart(std::span<const std::filesystem::path> inputs, std::span<const std::filesystem::path> outputs);

/// Throws UsageError where two outputs are the same file, by whatever name, or one lies in another that is a directory.
void expect_apart_from_each_other(std::span<const std::filesystem::path> outputs);

}  // namespace trihedron::io
