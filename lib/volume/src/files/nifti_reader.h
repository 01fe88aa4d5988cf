// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// NIfTI-1 and NIfTI-2 in one file (.nii, .nii.gz) or as a pair (.hdr and .img, packed or not;
// either of the two may be named); either byte order. The sform is preferred, then the qform;
// without both the voxel sizes alone are used, with a warning. RAS becomes LPS. Of several time
// points options.time is taken; without it a file of several is refused, and how many it holds is
// said.
Volume read_nifti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

}  // namespace organbake
