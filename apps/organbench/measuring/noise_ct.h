// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/region.h"

namespace organbake {

// A CT of noise, 512 × 512 × 300, in a MetaImage that is not packed: of packed voxels all up to the
// last one needed must be unpacked. Throws IoError.
Volume write_noise_ct(const std::filesystem::path& file);

// The world's box round the middle that holds this share of each axis.
Region middle_of(const Volume& ct, const Eigen::Vector3d& share);

}  // namespace organbake
