// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// NRRD (.nrrd, or .nhdr with one data file): raw, ascii, gzip or bzip2, either byte order, line and
// byte skip; `space` LPS, RAS or LAS, `space directions` and `space origin`. Source:
// teem.sourceforge.net/nrrd/format.html. (vtkNrrdReader ignores the directions, which is why this
// is not it.)
Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options = {});

}  // namespace organbake
