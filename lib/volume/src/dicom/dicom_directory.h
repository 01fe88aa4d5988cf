// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

namespace organbake {

// Whether a file is the directory of a DICOM disc (DICOMDIR), by its content.
bool is_dicom_directory(const std::filesystem::path& file);

// The images that a DICOMDIR lists, relative to its folder, in its order. Throws BadDataError.
std::vector<std::filesystem::path> images_of_directory(const std::filesystem::path& file);

// A listed file as it is called on this disk: names are upper case by the standard, and often lower
// case or with ";1" behind them once they are copied. Empty when there is no such file.
std::filesystem::path as_on_disc(const std::filesystem::path& root,
                                 const std::filesystem::path& listed);

}  // namespace organbake
