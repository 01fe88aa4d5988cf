// SPDX-License-Identifier: Apache-2.0
#include "array_arguments.h"

#include <pybind11/pybind11.h>

#include <filesystem>

#include "organbake/core/error.h"

namespace organbake {
namespace py = pybind11;
namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t d = 0; d < array.ndim(); ++d)
    text += std::to_string(array.shape(d)) + (d + 1 < array.ndim() ? ", " : "");
  return text + (array.ndim() == 1 ? ",)" : ")");
}

// An array of real numbers, whatever their kind.
Numbers real_numbers(const py::object& argument, const std::string& name,
                     const std::string& wanted) {
  const py::array any = py::array::ensure(argument);
  if (!any) {
    PyErr_Clear();
    throw UsageError(name + " is no array of numbers; it must be " + wanted);
  }
  const char kind = any.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    throw UsageError(name + " holds " + std::string(py::str(any.dtype())) +
                     ", no real numbers; it must be " + wanted);
  Numbers numbers = Numbers::ensure(any);
  if (!numbers) {
    PyErr_Clear();
    throw UsageError(name + " cannot be read as numbers; it must be " + wanted);
  }
  return numbers;
}

}  // namespace

std::vector<Eigen::Vector3d> vectors_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of shape (n, 3)";
  const Numbers numbers = real_numbers(argument, name, wanted);
  if (numbers.size() == 0) return {};
  if (numbers.ndim() != 2 || numbers.shape(1) != 3)
    throw UsageError(name + " has the shape " + shape_text(numbers) + "; it must be " + wanted);
  std::vector<Eigen::Vector3d> vectors;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i)
    vectors.emplace_back(numbers.at(i, 0), numbers.at(i, 1), numbers.at(i, 2));
  return vectors;
}

std::vector<double> numbers_from(const py::object& argument, const std::string& name,
                                 std::size_t count) {
  const std::string wanted = "one number, or an array of shape (" + std::to_string(count) + ",)";
  const Numbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() == 0) return std::vector<double>(count, *numbers.data());
  if (numbers.ndim() != 1 || std::size_t(numbers.shape(0)) != count)
    throw UsageError(name + " has the shape " + shape_text(numbers) + "; it must be " + wanted);
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
  const Numbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() != 1 || numbers.shape(0) != 3)
    throw UsageError(name + " has the shape " + shape_text(numbers) + "; it must be " + wanted);
  return Eigen::Vector3d(numbers.data());
}

Eigen::Matrix<double, 3, 4> pose_matrix_from(const py::object& argument, const std::string& name) {
  const std::string wanted = "an array of shape (3, 4) or (4, 4)";
  const Numbers numbers = real_numbers(argument, name, wanted);
  if (numbers.ndim() != 2 || numbers.shape(1) != 4 ||
      (numbers.shape(0) != 3 && numbers.shape(0) != 4))
    throw UsageError(name + " has the shape " + shape_text(numbers) + "; it must be " + wanted);
  const auto at = [&](int r, int c) { return numbers.at(r, c); };
  if (numbers.shape(0) == 4 && !(at(3, 0) == 0 && at(3, 1) == 0 && at(3, 2) == 0 && at(3, 3) == 1))
    throw UsageError(name + " is no rigid motion: its last row must be 0 0 0 1");
  Eigen::Matrix<double, 3, 4> matrix;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) matrix(r, c) = at(r, c);
  return matrix;
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
  if (!single && !twice)
    throw UsageError(name + " holds " + std::string(py::str(array.dtype())) + "; it must be " +
                     wanted);
  if (array.ndim() != axes || array.shape(axes - 1) != 3)
    throw UsageError(name + " has the shape " + shape_text(array) + "; it must be " + wanted);
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

py::array_t<double> array_of(const std::vector<Eigen::Vector3d>& vectors) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  auto* const kept = new std::vector<Eigen::Vector3d>(vectors);
  const py::capsule owner(kept,
                          [](void* p) { delete static_cast<std::vector<Eigen::Vector3d>*>(p); });
  return py::array_t<double>({py::ssize_t(kept->size()), py::ssize_t(3)},
                             reinterpret_cast<const double*>(kept->data()), owner);
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
