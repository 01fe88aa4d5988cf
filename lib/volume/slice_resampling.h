// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "volume/dicom_stack.h"
#include "volume/volume.h"

namespace organbake {

// Brings a decoded stack with gantry tilt or uneven gaps onto a regular upright grid by linear
// interpolation: in-plane shifts between pixels, and between the two neighbouring slices. The grid
// grows by the shifts, so nothing is cut off; what no slice covers gets the stack's lowest value.
// `decoded` has the grid of the first slice.
Volume resample_stack(const DicomStack& stack, const Volume& decoded);

}  // namespace organbake
