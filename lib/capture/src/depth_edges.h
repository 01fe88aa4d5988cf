// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

namespace organbake {

// Two texels side by side lie on one surface when their depths differ by at most this many texel
// widths (depth / focal length in pixels): a plane seen 80° from facing.
inline constexpr double kSteepestDepth = 5.67;

// Distance, in texels, from each texel's centre to the nearest depth edge: a jump between
// neighbours that kSteepestDepth does not explain, an outline against the background, or the
// image's border. At most `reach`; 0 for background. Depth is planar, +inf = background.
std::vector<float> depth_edge_distance(std::span<const float> depth_mm, int width, int height,
                                       double focal_px, double reach);

}  // namespace organbake
