#pragma once
/// What a target can measure of itself; one file for each kind of target defines it.

#include <cstddef>
#include <cstdint>

namespace trihedron::targets {

/// Whether the numbers below are measured; they are zero where not.
[[nodiscard]] bool measures();
/// Makes the counter run.
void start_counting();
/// Instructions executed so far, in steps of the counter; wraps round at kCounterRange.
[[nodiscard]] std::uint32_t instructions();
/// Between two of them, at most kCounterRange apart.
[[nodiscard]] std::uint32_t instructions_between(std::uint32_t before, std::uint32_t after);

/// Fills the stack below the caller with a pattern.
void paint_stack();
/// How far below the caller that painted it something has been written since, in bytes.
[[nodiscard]] std::size_t stack_used();

}  // namespace trihedron::targets
