#pragma once
/// The parts of the module, each in a source file of its own.

#include <nanobind/nanobind.h>

#include <memory>
#include <optional>
#include <string>

#include "trihedron/io/pass.hpp"
#include "trihedron/records/finding.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::python {

/// A pass as it was screened; results refer to it.
struct ScreenedPass {
  io::LoadedPass loaded;
  [[nodiscard]] const Pass& pass() const { return loaded.pass; }
};

/// Of the text of settings. Throws InputRefused.
[[nodiscard]] CalibrationOptions options_of(const std::string& settings);

void bind_errors(nanobind::module_& module);
void bind_pass(nanobind::module_& module);
void bind_results(nanobind::module_& module);
void bind_work(nanobind::module_& module);
void bind_pipeline(nanobind::module_& module);

}  // namespace trihedron::python
