// What the parts of the Python module share. Each part binds one subject in a .cpp of its own.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "sim/scene/reader/reader.h"

namespace duet::python {

namespace py = pybind11;

// Floating-point arrays as NumPy hands them over, in C order, converted if necessary.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Bind the scene, its keys and its bodies; simulations and their frames; pictures.
void bind_scene(py::module_& module);
void bind_frame(py::module_& module);
void bind_simulation(py::module_& module);
void bind_pictures(py::module_& module);

// Translates the errors of the simulator to those of duet.errors.
void bind_errors();

// Returns a read-only array of `shape` that shows the numbers at `data` without a copy, and keeps `owner`
// alive. Its memory is never written as long as `owner` exists.
template <class Number>
py::array view(const Number* data, std::vector<py::ssize_t> shape, py::handle owner) {
  static const Number none{};  // arrays without elements have no data
  py::array array(py::dtype::of<Number>(), std::move(shape), data ? data : &none, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

// Returns three numbers of Python as a vector. Throws Error (usage) that names `what` if they are not three.
Vec3 vector_of(const Doubles& numbers, const char* what);
// Returns a new array of three numbers.
py::array array_of(const Vec3& vector);

// Returns the text of the effect plan of `scene` without the effects named in `without`, as a list of
// (effect, whether it is active, reason).
py::list plan_of(const scene::Scene& scene, const std::vector<std::string>& without);

}  // namespace duet::python
