// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

struct AlbedoRegions {
  Mask region;                 // 0-based index per pixel; meaningless outside
  std::vector<double> albedo;  // of each, relative to the largest region
};

// Tissue of different colours (gallbladder against liver): up to `most` clusters of chromaticity
// (k-means from fixed seeds). Shading is continuous where two of them meet, so the median ratio of
// brightness across their common border is the ratio of their albedos; regions that meet none
// keep 1.
AlbedoRegions find_albedo_regions(const Rgb8Image& frame, const Plane& intensity,
                                  const Mask& inside, int most = 3);

// intensity / albedo of its region.
void normalise_albedo(const AlbedoRegions& regions, Plane& intensity);

}  // namespace organbake
