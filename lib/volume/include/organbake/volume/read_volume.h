// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/core/run_context.h"
#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Reads NIfTI (.nii, .nii.gz; RAS converted to LPS here, once), MetaImage (.mha, .mhd), NRRD
// (.nrrd, .nhdr), VTI, or a folder or zip holding a DICOM CT series. The kind is told by content
// and ending. Throws NoInputError (missing, empty folder, folder without DICOM), BadDataError, or
// UsageError when a series is asked for that only a DICOM folder could have.
Volume read_volume(const std::filesystem::path& path, const VolumeReadOptions& options,
                   const RunContext& context = {});
Volume read_volume(const std::filesystem::path& path, const RunContext& context = {});

// Whether a folder holds masks, one file each, called as their labels are (TotalSegmentator writes
// "liver.nii.gz"), and nothing of DICOM. read_volume() takes it as one mask of these names.
bool is_folder_of_masks(const std::filesystem::path& path);

}  // namespace organbake
