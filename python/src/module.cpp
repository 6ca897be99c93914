#include <nanobind/nanobind.h>

#include "bindings.hpp"

NB_MODULE(_native, module) {
  module.doc() = "Calibration of electrostatic gyros: what the package trihedron is made of. Use that.";
  module.attr("version") = TRIHEDRON_VERSION;
  trihedron::python::bind_errors(module);
  trihedron::python::bind_pass(module);
  trihedron::python::bind_results(module);
  trihedron::python::bind_work(module);
  trihedron::python::bind_pipeline(module);
}
