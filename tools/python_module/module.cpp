// The extension module duet._core: the simulator and the renderer for the Python package `duet`, whose Python
// files make a convenient interface of it.
#include "bindings.h"
#include "tools/processor/processor.h"
#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/stop.h"

namespace duet::python {
namespace {

// Raises the exception class `name` of duet.errors, called with the given arguments.
template <class... Arguments>
void raise(const char* name, Arguments&&... arguments) {
  const py::object type = py::module_::import("duet.errors").attr(name);
  const py::object error = type(std::forward<Arguments>(arguments)...);
  PyErr_SetObject(type.ptr(), error.ptr());
}

py::list problems_of(const SceneError& error) {
  const py::object type = py::module_::import("duet.errors").attr("Problem");
  py::list list;
  for (const SceneProblem& p : error.problems())
    list.append(type(p.file, p.line, p.column, p.key, p.message, p.hint));
  return list;
}

void translate(std::exception_ptr pointer) {
  try {
    if (pointer) std::rethrow_exception(pointer);
  } catch (const SceneError& error) {
    raise("SceneError", error.what(), problems_of(error));
  } catch (const SimulationError& error) {
    const SimulationFault& f = error.fault();
    raise("SimulationError", error.what(),
          py::dict(py::arg("stage") = f.stage, py::arg("time") = f.time, py::arg("frame") = f.frame,
                   py::arg("substep") = f.substep, py::arg("body") = f.body, py::arg("element") = f.element,
                   py::arg("position") = array_of(f.position), py::arg("value") = f.value,
                   py::arg("bound") = f.bound, py::arg("cause") = f.cause, py::arg("remedy") = f.remedy));
  } catch (const FileError& error) {
    raise("FileError", error.what(), error.path());
  } catch (const Stopped& error) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  } catch (const Error& error) {
    raise("Error", error.what(), static_cast<int>(error.status()));
  }
}

}  // namespace

void bind_errors() { py::register_exception_translator(translate); }

Vec3 vector_of(const Doubles& numbers, const char* what) {
  if (numbers.size() != 3)
    throw Error(ExitStatus::usage, fmt::format("{} has {} numbers: give 3", what, numbers.size()));
  return Vec3(numbers.data()[0], numbers.data()[1], numbers.data()[2]);
}

py::array array_of(const Vec3& vector) { return py::array_t<double>(3, vector.data()); }

}  // namespace duet::python

PYBIND11_MODULE(_core, module) {
  using namespace duet;
  char lack[processor::sentence_size];
  if (processor::describe_lack("duet", processor::required_features, processor::present_features(), lack))
    throw pybind11::import_error(lack);
  module.doc() = "The simulator and the renderer; use the package `duet` instead.";
  python::bind_errors();
  python::bind_scene(module);
  python::bind_frame(module);
  python::bind_simulation(module);
  python::bind_pictures(module);
}
