// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "files/voxel_decoding.h"
#include "organbake/core/run_context.h"
#include "organbake/volume/dicom_slice.h"
#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Hounsfield units of air: what padding outside the scanner's field of view becomes.
inline constexpr std::int16_t kAir_hu = -1000;

// Decodes slices of equal size into the volume, one after another, as Hounsfield units: every
// slice's own rescale applied, padding turned into air. Of each slice only the columns and rows of
// `window` are kept; volume.size must be theirs times the number of slices. Slices are decoded in
// parallel. The volume becomes real where a value asks for it, or when `real` does. Throws
// BadDataError naming the file: truncated, damaged, colour, several frames, or in a coding that is
// not read, such as lossy JPEG of 8 or 12 bits, which cannot hold CT values.
void decode_slices(std::span<const DicomSlice> slices, const IndexBox& window, Volume& volume,
                   const RunContext& context, bool real = false);

}  // namespace organbake
