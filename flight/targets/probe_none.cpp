// Of targets under an operating system: nothing is measured.

#include "probe.hpp"

namespace trihedron::targets {

bool measures() { return false; }
void start_counting() {}
std::uint32_t instructions() { return 0; }
std::uint32_t instructions_between(std::uint32_t /*before*/, std::uint32_t /*after*/) { return 0; }
void paint_stack() {}
std::size_t stack_used() { return 0; }

}  // namespace trihedron::targets
