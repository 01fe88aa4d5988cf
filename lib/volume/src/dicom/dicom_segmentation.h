// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// A DICOM segmentation (PS3.3, C.8.20): binary, fractional (from one half on) or a label map, on
// the grid of its frames. Segments keep their numbers and names and may overlap; options.label
// chooses. Throws BadDataError.
Volume read_dicom_segmentation(const std::filesystem::path& file, const VolumeReadOptions& options);

}  // namespace organbake
