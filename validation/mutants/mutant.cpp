// Which edit runs: the environment says so before anything else of the program.

#include "mutant.hpp"

#include <cstdlib>

extern "C" {

int trihedron_mutant = 0;

[[gnu::constructor(101)]] static void choose_mutant() {
  const char* number = std::getenv("TRIHEDRON_MUTANT");
  trihedron_mutant = number != nullptr ? std::atoi(number) : 0;
}

}  // extern "C"
