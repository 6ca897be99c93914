#pragma once
/// One assert for a programmer's mistake, always on. Bad telemetry is data and never ends here.

namespace trihedron {

/// What happens when an assertion fails; must not return to the caller (the default aborts).
using AssertHandler = void (*)(const char* expression, const char* file, int line);

/// Replaces the handler and returns the previous one. Not to be called while other threads run core.
AssertHandler set_assert_handler(AssertHandler handler);

namespace detail {
[[noreturn]] void assertion_failed(const char* expression, const char* file, int line);
}

}  // namespace trihedron

/// Ends in the handler, in all builds, unless the expression is true.
#define TRIHEDRON_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::trihedron::detail::assertion_failed(#expression, __FILE__, __LINE__))
