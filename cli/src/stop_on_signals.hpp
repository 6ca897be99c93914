#pragma once

#include <functional>

namespace trihedron::cli {

/// Calls `program`, which gives an exit status, so that SIGINT, SIGTERM, SIGHUP and SIGPIPE stop it (records/stop.hpp).
/// Then the process ends by that signal, as one does that knows nothing of it: whoever called it sees which one it was.
/// A signal that the caller has had ignored stays ignored.
int stopped_by_signals(const std::function<int()>& program);

}  // namespace trihedron::cli
