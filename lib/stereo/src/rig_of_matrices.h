// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/named_matrices.h"
#include "organbake/stereo/stereo_rig.h"

namespace organbake {

// The rig that OpenCV's matrices say: lenses and R, T; or what was rectified (stereo_rig.h). `path`
// is named in errors. Throws BadDataError.
StereoRig rig_of_matrices(const NamedMatrices& found, const std::filesystem::path& path,
                          const EyePictures& pictures);

}  // namespace organbake
