// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/run_context.h"
#include "volume/dicom_stack.h"
#include "volume/volume.h"

namespace organbake {

// Decodes the pixels of a stack into volume.voxels, slice after slice, as Hounsfield units (every
// slice's own rescale applied). Slices are decoded in parallel; volume.size must be set. Throws
// BadDataError naming the file: truncated, damaged, colour, several frames, or lossy JPEG of 8 or
// 12 bits, which cannot hold CT values.
void decode_stack(const DicomStack& stack, Volume& volume, const RunContext& context);

}  // namespace organbake
