// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/core/run_context.h"
#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// The CT volume of a folder of DICOM files (not of its subfolders), of a file of several frames, of
// the series that one slice belongs to, or of a DICOMDIR, in Hounsfield units. Files that are not
// DICOM are passed over. Of several series options.series is taken, or the one that is a CT volume,
// and `warnings` says which, why, and what was passed over. The grid comes from
// ImagePositionPatient alone; gantry tilt and uneven spacing are resampled to a regular grid, with
// a warning. Throws NoInputError when the folder holds no DICOM, BadDataError for anything that
// cannot be a trustworthy CT volume.
Volume read_dicom(const std::filesystem::path& path, const VolumeReadOptions& options = {},
                  const RunContext& context = {});

}  // namespace organbake
