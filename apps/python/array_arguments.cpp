// SPDX-License-Identifier: Apache-2.0
#include "array_arguments.h"

#include <filesystem>

namespace organbake {
namespace py = pybind11;

py::array array_from(const py::object& argument, const std::string& name,
                     const std::string& wanted) {
  py::array array = py::array::ensure(argument);
  if (array) return array;
  PyErr_Clear();
  throw UsageError(name + " is no array of numbers; it must be " + wanted);
}

void refuse(const py::array& array, const std::string& name, const std::string& wanted) {
  throw UsageError(name + " holds " + std::string(py::str(array.dtype())) + " in the shape " +
                   std::string(py::str(array.attr("shape"))) + "; it must be " + wanted);
}

RealNumbers real_numbers(const py::object& argument, const std::string& name,
                         const std::string& wanted) {
  const py::array any = array_from(argument, name, wanted);
  if (std::string("biuf").find(any.dtype().kind()) == std::string::npos) refuse(any, name, wanted);
  return RealNumbers::ensure(any);
}

std::vector<Eigen::Vector3d> vectors_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of shape (n, 3)";
  const RealNumbers numbers = real_numbers(argument, name, wanted);
  if (numbers.size() == 0) return {};
  if (numbers.ndim() != 2 || numbers.shape(1) != 3) refuse(numbers, name, wanted);
  std::vector<Eigen::Vector3d> vectors;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i) vectors.emplace_back(numbers.data(i));
  return vectors;
}

std::vector<double> numbers_from(const py::object& argument, const std::string& name,
                                 std::size_t count) {
  const std::string wanted = "one number, or an array of shape (" + std::to_string(count) + ",)";
  const RealNumbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() == 0) return std::vector<double>(count, *numbers.data());
  if (numbers.ndim() != 1 || std::size_t(numbers.size()) != count) refuse(numbers, name, wanted);
  return {numbers.data(), numbers.data() + count};
}

std::vector<bool> flags_from(const py::object& argument, const std::string& name,
                             std::size_t count) {
  std::vector<bool> flags;
  for (const double value : numbers_from(argument, name, count)) flags.push_back(value != 0);
  return flags;
}

Eigen::Vector3d vector_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of shape (3,)";
  const RealNumbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() != 1 || numbers.size() != 3) refuse(numbers, name, wanted);
  return Eigen::Vector3d(numbers.data());
}

RigidTransform pose_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of shape (3, 4) or (4, 4)";
  const RealNumbers numbers = real_numbers(argument, name, wanted);
  const bool square = numbers.size() == 16;
  if (numbers.ndim() != 2 || numbers.shape(1) != 4 || (numbers.shape(0) != 3 && !square))
    refuse(numbers, name, wanted);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;
  const Eigen::Map<const Rows> rows(numbers.data(), numbers.shape(0), 4);
  if (square && rows.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw UsageError(name + " is no rigid motion: its last row must be 0 0 0 1");
  if (!rows.allFinite()) throw UsageError(name + " is not finite");
  const auto rotation = written_rotation(rows.topLeftCorner<3, 3>());
  if (!rotation)
    throw UsageError(name + " holds no proper rotation (RᵀR must be I and det R = +1)");
  return {*rotation, rows.topRightCorner<3, 1>()};
}

namespace {

// What lies in memory already: arrays, what has a buffer, and what is told by DLPack.
py::array array_in_memory(const py::object& argument, const std::string& refusal) {
  if (py::isinstance<py::array>(argument)) return py::reinterpret_borrow<py::array>(argument);
  if (PyObject_CheckBuffer(argument.ptr()) != 0) return py::array::ensure(argument);
  if (!py::hasattr(argument, "__dlpack__")) throw UsageError(refusal);
  return py::module_::import("numpy").attr("from_dlpack")(argument);
}

}  // namespace

RawNumbers raw_numbers(const py::object& argument, const std::string& name, int axes) {
  const std::string wanted =
      "a float32 or float64 array of shape " + std::string(axes == 2 ? "(n, 3)" : "(states, n, 3)");
  py::array array = array_in_memory(argument, name + " must be " + wanted);
  const bool single = py::isinstance<py::array_t<float>>(array),
             twice = py::isinstance<py::array_t<double>>(array);
  if ((!single && !twice) || array.ndim() != axes || array.shape(axes - 1) != 3)
    refuse(array, name, wanted);
  if (!(array.flags() & py::array::c_style))
    array = py::module_::import("numpy").attr("ascontiguousarray")(array);
  RawNumbers numbers;
  numbers.rows = static_cast<std::size_t>(array.shape(0));
  const auto size = static_cast<std::size_t>(array.size());
  if (single) {
    numbers.values = std::span(static_cast<const float*>(array.data()), size);
  } else {
    numbers.values = std::span(static_cast<const double*>(array.data()), size);
  }
  numbers.array = std::move(array);
  return numbers;
}

void translate_error(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Error& error) {
    switch (error.code()) {
      case ExitCode::usage:
      case ExitCode::bad_data:
      case ExitCode::bad_recipe:
        return PyErr_SetString(PyExc_ValueError, error.what());
      case ExitCode::no_input:
      case ExitCode::read_error:
      case ExitCode::cannot_write:
        return PyErr_SetString(PyExc_OSError, error.what());
      default:
        return PyErr_SetString(PyExc_RuntimeError, error.what());
    }
  } catch (const std::filesystem::filesystem_error& error) {
    PyErr_SetString(PyExc_OSError, error.what());
  }
}

}  // namespace organbake
