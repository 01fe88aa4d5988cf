// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/formats/lens_files.h"

namespace organbake {

// cameras.txt and images.txt of a COLMAP model's folder, or cameras.bin and images.bin
// (camera_files.h).
CameraSet read_colmap_text(const std::filesystem::path& folder, const RunContext& context);
CameraSet read_colmap_binary(const std::filesystem::path& folder, const RunContext& context);

// OpenGL's camera looks along −z with y up, ours along +z with y down.
inline const Eigen::DiagonalMatrix<double, 3> kOpenGlAxes(1, -1, -1);

// Of a matrix; the largest that counts has 16.
inline constexpr std::size_t kMostMatrixValues = 64;

// "Camera_Matrix" → "cameramatrix".
std::string plain_name(const std::string& name);

// Whether a word is one of those known.
bool is_any_of(const std::string& word, Names known);

// Nothing where a matrix of that size holds another number of values.
std::optional<NamedMatrices::Matrix> shaped(std::vector<double> values, double height,
                                            double width);

// Why what has a name is no matrix, as a sentence that names file and matrix.
std::string unreadable(const std::filesystem::path& path, const std::string& name,
                       const std::string& fault);

// Adds what the text of OpenCV's XML file storage holds. Throws BadDataError.
void add_opencv_xml(std::string_view xml, const std::filesystem::path& path, NamedMatrices& found);

// Throws BadDataError that says what it is and what to do, where the bytes are those of a
// calibration of another program that is not read: NumPy's .npz and .npy, MATLAB's .mat, Python's
// pickles, OCamCalib's polynomials.
void refuse_foreign_calibration(const std::string& bytes, const std::filesystem::path& path);

// Adds the sections of an .ini as parts: numbers and words. Throws BadDataError for a line that is
// neither a section's name nor KEY = VALUE.
void add_ini(const std::string& text, const std::filesystem::path& path, NamedMatrices& found);

}  // namespace organbake
