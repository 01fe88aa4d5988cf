// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/formats/named_matrices.h"

namespace organbake {

// Of a matrix; the largest that counts has 16.
inline constexpr std::size_t kMostMatrixValues = 64;

// "Camera_Matrix" → "cameramatrix".
std::string plain_name(const std::string& name);

// Whether a word is one of those known.
bool is_any_of(const std::string& word, std::initializer_list<const char*> known);

// Nothing where a matrix of that size holds another number of values.
std::optional<NamedMatrices::Matrix> shaped(std::vector<double> values, double height,
                                            double width);

// Why what has a name is no matrix: of its header, and as a sentence that names file and matrix.
std::string unlike_header(const std::string& rows, const std::string& columns, std::size_t count);
std::string unreadable(const std::filesystem::path& path, const std::string& name,
                       const std::string& fault);

// Adds what the text of OpenCV's XML file storage holds. Throws BadDataError.
void add_opencv_xml(std::string_view xml, const std::filesystem::path& path, NamedMatrices& found);

}  // namespace organbake
