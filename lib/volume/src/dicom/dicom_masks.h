// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

enum class DicomMaskKind { none, segmentation, contours };
// What a DICOM file holds in place of an image, by its SOP class: a segmentation (SEG) or contours
// (RTSTRUCT). None for a file that cannot be read.
DicomMaskKind dicom_mask_kind(const std::filesystem::path& file);

// A DICOM segmentation (PS3.3, C.8.20): binary, fractional (from one half on) or a label map. Each
// frame lies by its own corner, and is as thick as the slice of options.scan that it lies on; see
// slabs_of. Segments keep their numbers and names and may overlap; options.label chooses, and
// options.time where frames tell several phases. Throws BadDataError.
Volume read_dicom_segmentation(const std::filesystem::path& file, const VolumeReadOptions& options);

// The closed contours of an RTSTRUCT (PS3.3, C.8.8.6) as a mask, a label for each region of
// interest, finer in the plane than any CT. Contours in one plane are united, but for one inside
// another, which is a hole; see ContourRegion. Contours that a program drew round the voxels of
// options.scan, along their edges or from centre to centre, give these voxels back, on the scan's
// grid. A region's number and name choose it. Throws BadDataError.
Volume read_dicom_contours(const std::filesystem::path& file, const VolumeReadOptions& options);

// Warns where a mask names another frame of reference than options.scan; empty = it names none.
void warn_of_other_space(const std::string& frame_of_reference_uid,
                         const VolumeReadOptions& options, std::vector<std::string>& warnings);

}  // namespace organbake
