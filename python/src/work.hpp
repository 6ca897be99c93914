#pragma once
/// Long work for Python: without the interpreter's lock, with its progress told and an end when Python is asked for
/// one.

#include <nanobind/nanobind.h>

#include <functional>
#include <optional>
#include <utility>

#include "trihedron/records/progress.hpp"

namespace trihedron::python {

/// Calls work(meter) in a thread of its own while this one waits: `progress`, a callable or None, is called here with
/// the fraction done, and the handlers of Python's signals run. What either of them raises stops the work and is raised
/// again once that has ended; so is what the work throws.
void interruptible(const nanobind::object& progress, const std::function<void(const Progress&)>& work);

/// The same of work that returns something.
template <class Work>
auto interruptible_result(const nanobind::object& progress, const Work& work) {
  std::optional<decltype(work(Progress{}))> result;
  interruptible(progress, [&](const Progress& meter) { result.emplace(work(meter)); });
  return *std::move(result);
}

}  // namespace trihedron::python
