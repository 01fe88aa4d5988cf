// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/run_context.h"

namespace organbake {

// Smallest and largest value among a map's texels; both 0 when it shows nothing.
struct TexelRange {
  double least = 0, most = 0;
};

// One camera's maps, reduced to small pictures of at most kThumbnailSide pixels a side.
struct MapThumbnails {
  Rgb8Image color, depth, micro;
  TexelRange depth_mm, height_mm;  // of the full maps
  double filled_share = 0;         // of the texels, those that show the organ
};
inline constexpr int kThumbnailSide = 112;

// Near is light in `depth`. In `micro` the surface stands above the proxy where it is red, below it
// where it is blue, and lies on it where it is white; full colour is height_limit_mm.
MapThumbnails map_thumbnails(const CameraMaps& maps, double height_limit_mm);

// The proxy's edges as one camera sees them over its colour map: an inline SVG. What the surface
// hides from the camera is not drawn.
std::string proxy_over_surface(const Bundle& frame, const CameraMaps& maps, std::size_t camera);

struct BundlePictures {
  std::vector<MapThumbnails> thumbnails;  // by camera
  double height_limit_mm = 0;
  // Of camera 0, and of the one that looks most against it, if there is another.
  std::vector<std::string> proxies_svg;
  std::vector<std::size_t> proxy_cameras;
};

// Reads all maps of a bundle, two or three at a time. Throws BadDataError for a damaged one.
BundlePictures bundle_pictures(const BundleReader& reader, const Bundle& frame);

}  // namespace organbake
