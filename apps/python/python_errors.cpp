// SPDX-License-Identifier: Apache-2.0
#include "python_errors.h"

#include <pybind11/pybind11.h>

#include <filesystem>

#include "organbake/core/error.h"

namespace organbake {

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
