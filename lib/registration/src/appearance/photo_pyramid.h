// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// One level of a photograph's pyramid: linear luminance, and which pixels count.
struct PhotoLevel {
  int factor = 1;  // of the photograph's pixels per pixel here, along a side
  Intrinsics intrinsics;
  std::vector<float> luminance;       // row-major; 0…1
  std::vector<std::uint8_t> valid;    // 0 or 1
  std::vector<Eigen::Vector3f> rays;  // camera axes, z = 1, through pixel centres

  std::size_t index(int x, int y) const { return std::size_t(y) * intrinsics.width + x; }
};

// Which pixels of a photograph are not in the black border of a round field of view, and not black
// in `mask` (8-bit RGB of the photograph's size; nothing when empty).
std::vector<std::uint8_t> pixels_in_field(const Rgb8Image& photo, const Rgb8Image& mask);
// Those of them that count: neither blown out nor next to a pixel that is.
std::vector<std::uint8_t> valid_pixels(const Rgb8Image& photo, const Rgb8Image& mask);

// Levels of factor 1, 2, 4 … each the mean of 2×2 pixels of the one before, the sensor's own way of
// seeing coarsely; down to `coarsest_side` pixels on the longer side. A level is coarse[i]; the
// finest one has at most `finest_side` pixels on its longer side. Fewer than 8 pixels a side are
// no level: a photo too small for one gives none.
std::vector<PhotoLevel> photo_pyramid(const Rgb8Image& photo, const Rgb8Image& mask,
                                      const Intrinsics& intrinsics, int finest_side,
                                      int coarsest_side);

// Rays through the pixel centres of a lens, row by row.
std::vector<Eigen::Vector3f> pixel_rays(const Intrinsics& intrinsics);

// 1 inside the round field of view of an endoscope, 0 in its black border; all 1 when the picture
// has no such border. The field is found as a circle: seen from the picture's centre, the outermost
// pixels that are not black lie on one, cut by the picture's edges at most. A dark background
// round an organ is no border: its outline is no circle, or far too small a one.
std::vector<std::uint8_t> inside_round_field(const Rgb8Image& photo);

}  // namespace organbake
