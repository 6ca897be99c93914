#include <nanobind/nanobind.h>

#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "bindings.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::python {
namespace nb = nanobind;
namespace {

nb::object exception_class(const char* name) { return nb::module_::import_("trihedron._errors").attr(name); }

void raise(const char* name, const std::string& reason, const std::string& cure, const nb::object& file,
           io::Position position = {}) {
  const nb::object type = exception_class(name);
  const nb::object error = type(reason, cure, file, position.line, position.column);
  PyErr_SetObject(type.ptr(), error.ptr());
}

void translate(const std::exception_ptr& thrown, void* /*payload*/) {
  try {
    std::rethrow_exception(thrown);
  } catch (const io::InputRefused& error) {
    raise("InputRefused", error.reason(), error.cure(), nb::str(error.file().c_str()), error.position());
  } catch (const io::MachineFailed& error) {
    raise("MachineFailed", error.reason(), error.cure(), nb::str(error.file().c_str()));
  } catch (const ground::SetupError& error) {
    raise("SetupError", error.what(), error.cure(), nb::none());
  } catch (const io::UsageError& error) {
    raise("InputRefused", error.what(), "correct the value", nb::none());
  } catch (const Stopped&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

}  // namespace

void bind_errors(nb::module_& /*module*/) { nb::register_exception_translator(translate); }

}  // namespace trihedron::python
