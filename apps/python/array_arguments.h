// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace organbake {

// What Python hands over, as numbers that C++ may hold without the interpreter. Each throws a
// UsageError, Python's ValueError, that names the argument, what it is and what it must be. None
// looks at whether the numbers are finite: the player does.
std::vector<Eigen::Vector3d> vectors_from(const pybind11::object& argument,
                                          const std::string& name);
// One for all, or one each.
std::vector<double> numbers_from(const pybind11::object& argument, const std::string& name,
                                 std::size_t count);
std::vector<bool> flags_from(const pybind11::object& argument, const std::string& name,
                             std::size_t count);
Eigen::Vector3d vector_from(const pybind11::object& argument, const std::string& name);
// 3 × 4, or 4 × 4 with the last row 0 0 0 1.
Eigen::Matrix<double, 3, 4> pose_matrix_from(const pybind11::object& argument,
                                             const std::string& name);

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

// (n, 3), over memory of its own.
pybind11::array_t<double> array_of(const std::vector<Eigen::Vector3d>& vectors);

// What C++ throws, as Python's own: ValueError for what was asked or what a file holds, OSError for
// files that are not there or cannot be used, with the programs' sentences.
void translate_error(std::exception_ptr thrown);

}  // namespace organbake
