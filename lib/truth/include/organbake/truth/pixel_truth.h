// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/truth/layer_set.h"
#include "organbake/truth/moment.h"
#include "organbake/warp/frame.h"

namespace organbake {

// Labels of a mask: 0 the background, the organs from kFirstOrganLabel on, the instruments from
// kFirstToolLabel on, both in the order in which they were given.
inline constexpr std::uint8_t kFirstOrganLabel = 1, kFirstToolLabel = 101;
inline constexpr std::size_t kMostLabelledOrgans = 100, kMostLabelledTools = 155;

// What the ray through each pixel's centre meets first. All planes have one number a pixel, top row
// first; those that were not asked for are empty.
struct PixelTruth {
  int width = 0, height = 0;
  std::vector<BoundPixel> bound;        // the skin, below tools, too
  std::vector<std::uint8_t> organ;      // whose; empty: the one and only
  std::vector<float> depth_mm;          // planar z, +inf at the background
  std::vector<std::uint8_t> label;      // see above
  std::vector<Eigen::Vector3f> point;   // camera mm; of no meaning at the background; with normals
  std::vector<Eigen::Vector3f> normal;  // camera axes, unit, towards the eye; 0 at the background
  std::vector<std::uint16_t> solid;     // 1 + the moment's solid, 0: none; empty without tools

  std::size_t pixels() const { return std::size_t(width) * height; }
  std::size_t organ_at(std::size_t pixel) const { return organ.empty() ? 0 : organ[pixel]; }
  std::size_t solid_at(std::size_t pixel) const { return solid.empty() ? 0 : solid[pixel]; }
};

// Works out what the layers need of a picture that was drawn with DrawOptions::keep_bound at a
// moment. The picture's bound pixels are taken out of it, and it will be drawn anew. Depth is that
// of the skin's sample at the pixel's centre; pixels that were filled are bound as their
// neighbours. The same for any number of threads.
void take_pixels(const Moment& moment, const LayerSet& layers, Frame& picture, PixelTruth& truth);

}  // namespace organbake
