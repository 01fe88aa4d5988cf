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

}  // namespace organbake
