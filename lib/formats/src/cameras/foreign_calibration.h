// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/formats/named_matrices.h"

namespace organbake {

// Throws BadDataError that says what it is and what to do, where the bytes are those of a
// calibration of another program that is not read: NumPy's .npz and .npy, MATLAB's .mat, Python's
// pickles, OCamCalib's polynomials.
void refuse_foreign_calibration(const std::string& bytes, const std::filesystem::path& path);

// Adds the sections of an .ini as parts: numbers and words. Throws BadDataError for a line that is
// neither a section's name nor KEY = VALUE.
void add_ini(const std::string& text, const std::filesystem::path& path, NamedMatrices& found);

}  // namespace organbake
