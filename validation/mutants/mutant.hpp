#pragma once
/// Which edit of core runs; included before each file of the build with all of them.

#include <type_traits>

extern "C" int trihedron_mutant;

/// What is computed by the compiler is the same in all of them.
constexpr bool trihedron_is_mutant(int number) { return !std::is_constant_evaluated() && trihedron_mutant == number; }
