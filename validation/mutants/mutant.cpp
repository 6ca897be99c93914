// Which edit runs: the environment says so before anything else of the program.

#include "mutant.hpp"

#include <cstdlib>

int trihedron_mutant = 0;

namespace {

[[gnu::constructor(101)]] void choose_mutant() {
  const char* number = std::getenv("TRIHEDRON_MUTANT");
  trihedron_mutant = number != nullptr ? static_cast<int>(std::strtol(number, nullptr, 10)) : 0;
}

}  // namespace
