// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <cstddef>
#include <exception>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {

// What Python hands over, as numbers that C++ may hold without the interpreter. Each throws a
// UsageError, Python's ValueError, that names the argument, what it is and what it must be. None
// looks at whether the numbers are finite, unless it says so: the player does.
using RealNumbers =
    pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
// Real numbers of any kind and shape, bools too.
RealNumbers real_numbers(const pybind11::object& argument, const std::string& name,
                         const std::string& wanted);
pybind11::array array_from(const pybind11::object& argument, const std::string& name,
                           const std::string& wanted);
[[noreturn]] void refuse(const pybind11::array& array, const std::string& name,
                         const std::string& wanted);
std::vector<Eigen::Vector3d> vectors_from(const pybind11::object& argument,
                                          const std::string& name);
// One for all, or one each.
std::vector<double> numbers_from(const pybind11::object& argument, const std::string& name,
                                 std::size_t count);
std::vector<bool> flags_from(const pybind11::object& argument, const std::string& name,
                             std::size_t count);
Eigen::Vector3d vector_from(const pybind11::object& argument, const std::string& name);
// Of 3 × 4 numbers, or 4 × 4 with the last row 0 0 0 1; finite.
RigidTransform pose_from(const pybind11::object& argument, const std::string& name);

// What one of several names stands for.
template <class Value>
Value chosen(const std::string& what, const std::string& name,
             std::initializer_list<std::pair<const char*, Value>> values) {
  std::string names;
  for (const auto& [one, value] : values) {
    if (name == one) return value;
    names += (names.empty() ? "" : ", ") + std::string(one);
  }
  throw UsageError(what + " '" + name + "' is none; take one of " + names);
}

// Numbers where they lie in the caller's array, which must stay as it is meanwhile, or in a copy of
// one whose numbers do not follow each other. To be destroyed with the interpreter's lock.
struct RawNumbers {
  std::variant<std::span<const float>, std::span<const double>> values;
  std::size_t rows = 0;    // along its first axis
  pybind11::object array;  // what holds them
};
// A float32 or float64 array of that many axes, the last of 3: NumPy's, or whatever has a buffer or
// DLPack's __dlpack__ in this processor's memory.
RawNumbers raw_numbers(const pybind11::object& argument, const std::string& name, int axes);

// Room for numbers: in the caller's array, or in a new one that `array` becomes where it is None.
template <class Number>
Number* room_in(pybind11::object& array, const std::string& name,
                const std::vector<pybind11::ssize_t>& shape) {
  namespace py = pybind11;
  if (array.is_none()) array = py::array_t<Number>(shape);
  auto given = py::reinterpret_borrow<py::array>(array);
  const bool fits = py::isinstance<py::array_t<Number>>(array) && given.writeable() &&
                    (given.flags() & py::array::c_style) != 0 &&
                    std::vector<py::ssize_t>(given.shape(), given.shape() + given.ndim()) == shape;
  if (!fits)
    throw UsageError(name + " must be a writeable, C-contiguous " +
                     std::string(py::str(py::dtype::of<Number>())) + " array of shape " +
                     std::string(py::str(py::tuple(py::cast(shape)))));
  return static_cast<Number*>(given.mutable_data());
}

// An array over a list, which it keeps.
template <class Number, class Item>
pybind11::array_t<Number> array_of(std::vector<Item> list, std::vector<pybind11::ssize_t> shape) {
  auto* const kept = new std::vector<Item>(std::move(list));
  const pybind11::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Item>*>(p); });
  return pybind11::array_t<Number>(std::move(shape), reinterpret_cast<const Number*>(kept->data()),
                                   owner);
}
// (n, k) of n points, faces or other rows of k numbers.
template <class Row>
auto rows_of(std::vector<Row> list) {
  using Number = std::remove_cvref_t<decltype(list[0][0])>;
  const auto rows = static_cast<pybind11::ssize_t>(list.size());
  constexpr pybind11::ssize_t kColumns = sizeof(Row) / sizeof(Number);
  return array_of<Number>(std::move(list), {rows, kColumns});
}

// What C++ throws, as Python's own: ValueError for what was asked or what a file holds, OSError for
// files that are not there or cannot be used, with the programs' sentences.
void translate_error(std::exception_ptr thrown);

}  // namespace organbake
