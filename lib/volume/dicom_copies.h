// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volume/dicom_slice.h"

namespace organbake {

// Two positions nearer than this are one place.
inline constexpr double kSamePlace_mm = 1e-3;

// Leaves one slice for every place along the normal, by which the slices are sorted: copies (the
// same stored pixels) go, and of several acquisitions of the same places the one with most slices
// stays; `warnings` names them. Throws BadDataError when all slices lie in one place, or when two
// that differ lie in the same place and nothing tells them apart.
std::vector<DicomSlice> without_copies(std::vector<DicomSlice> sorted,
                                       const std::filesystem::path& folder,
                                       std::vector<std::string>& warnings);

}  // namespace organbake
