// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "dicom/dicom_stack.h"
#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// The regular upright grid of a stack with gantry tilt or uneven gaps, without voxels. It grows by
// the shifts, so nothing is cut off. `first` is the grid of the stack's first slice.
Volume upright_grid(const DicomStack& stack, const Volume& first);

// Slices [first, end) of a stack.
struct SliceRange {
  int first = 0, end = 0;
  int count() const { return end - first; }
};
// Those that slices [k, k_end) of the upright grid lie between.
SliceRange slices_needed(const DicomStack& stack, int k, int k_end);

// Fills slices [k, k + count) of the upright grid's box `box` (k counted from the box's first) from
// the decoded slices `range` of the stack, by linear interpolation: in-plane shifts between pixels,
// and between the two neighbouring slices. What no slice covers becomes air.
void resample_slices(const DicomStack& stack, const Volume& decoded, const SliceRange& range,
                     const IndexBox& box, int k, int count, Volume& out);

}  // namespace organbake
