// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// The closed contours of an RTSTRUCT (PS3.3, C.8.8.6) as a mask, a label for each region of
// interest, finer in the plane than any CT. Contours in one plane are united, but for one inside
// another, which is a hole; see ContourRegion. Contours that a program drew round the voxels of
// options.scan, along their edges or from centre to centre, give these voxels back, on the scan's
// grid. A region's number and name choose it. Throws
// BadDataError.
Volume read_dicom_contours(const std::filesystem::path& file, const VolumeReadOptions& options);

}  // namespace organbake
