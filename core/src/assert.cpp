#include "trihedron/core/assert.hpp"

#include <cstdlib>

namespace trihedron {
namespace {

AssertHandler current_handler = nullptr;

}  // namespace

AssertHandler set_assert_handler(AssertHandler handler) {
  AssertHandler previous = current_handler;
  current_handler = handler;
  return previous;
}

void detail::assertion_failed(const char* expression, const char* file, int line) {
  if (current_handler != nullptr) {
    current_handler(expression, file, line);
  }
  std::abort();
}

}  // namespace trihedron
