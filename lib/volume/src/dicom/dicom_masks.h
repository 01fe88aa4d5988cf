// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

enum class DicomMaskKind { none, segmentation, contours };
// What a DICOM file holds in place of an image, by its SOP class: a segmentation (SEG) or contours
// (RTSTRUCT). None for a file that cannot be read.
DicomMaskKind dicom_mask_kind(const std::filesystem::path& file);

}  // namespace organbake
