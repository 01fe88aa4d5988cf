// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// MetaImage (.mha, .mhd with one raw or zlib file), as ITK writes and reads it: world = LPS, the
// TransformMatrix lists the unit vectors of the index axes one after the other. (vtkMetaImageReader
// ignores that matrix, which is why this is not it.)
Volume read_metaimage(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// NIfTI-1 and NIfTI-2 in one file (.nii, .nii.gz) or as a pair (.hdr and .img, packed or not;
// either of the two may be named); either byte order. The sform is preferred, then the qform;
// without both the voxel sizes alone are used, with a warning. RAS becomes LPS. Of several time
// points options.time is taken; without it a file of several is refused, and how many it holds is
// said.
Volume read_nifti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// NRRD (.nrrd, or .nhdr with one data file): raw, ascii, gzip or bzip2, either byte order, line and
// byte skip; `space` LPS, RAS or LAS, `space directions` and `space origin`. Source:
// teem.sourceforge.net/nrrd/format.html. (vtkNrrdReader ignores the directions, which is why this
// is not it.)
Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// VTK XML image data (.vti) through VTK's reader: the active (or only) point array of one
// component. VTK has no word for the patient's axes; its world is taken as LPS millimetres.
Volume read_vti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

}  // namespace organbake
