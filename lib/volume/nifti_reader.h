// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "volume/byte_stream.h"
#include "volume/read_options.h"
#include "volume/volume.h"

namespace organbake {

// NIfTI-1 in one file (.nii, .nii.gz; either byte order). The sform is preferred, then the qform;
// without both the voxel sizes alone are used, with a warning. RAS becomes LPS. Source: the
// NIfTI-1 header, nifti1.h (Cox et al. 2004).
Volume read_nifti(const std::filesystem::path& path, ByteStream::Coding coding,
                  const VolumeReadOptions& options = {});

}  // namespace organbake
