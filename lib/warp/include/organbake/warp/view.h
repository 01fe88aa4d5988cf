// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/image/channel_image.h"

namespace organbake {

inline constexpr int kLargestSide_px = 16384;  // of a picture that can be drawn

// A lens comes no nearer to what it shows: skin that lies nearer is not drawn.
inline constexpr double kNearest_mm = 0.25;

// Whoever looks: a pinhole without distortion, of any size, and the plane in front of which nothing
// is drawn (mm along the view).
struct View {
  PosedCamera camera;
  double near_mm = kNearest_mm;

  // Throws UsageError for distortion, a side beyond 16,384 pixels, or numbers that are not finite.
  void check() const;
};

bool operator==(const View& a, const View& b);

// Shares below this are dropped and the others drawn up to it, continuously: a camera that hardly
// counts is not worth its samples. Measured at ten views: up to 0.15 costs no view 0.01 dB; at 0.2
// one loses 0.8 dB, since the third camera alone sees a part of it.
inline constexpr double kLeastShare = 0.15;
ViewWeights trimmed(ViewWeights weights);

// What each camera counts in a view: the manifold's weights, trimmed.
ViewWeights drawn_shares(const ViewManifold& manifold, const View& view);
// The cameras that have a share in a view.
std::vector<std::size_t> used_cameras(const ViewWeights& weights);

// Pixels x0 … x1−1 by y0 … y1−1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  bool operator==(const PixelBox&) const = default;
};

// The smallest box round both.
inline PixelBox united(const PixelBox& a, const PixelBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

inline PixelBox intersected(const PixelBox& a, const PixelBox& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

// What a pixel of a frame shows.
enum class Cover : std::uint8_t { background = 0, samples, base, filled, solid };

// The skin that a pixel shows, as a point bound to the shell: any pose of the organ puts it
// somewhere, shell_point().
struct BoundPixel {
  static constexpr std::uint32_t kNoSkin = 0xFFFFFFFFu;
  std::uint32_t face = kNoSkin;  // of the shell's surface
  float b1 = 0, b2 = 0, height_mm = 0;
  float depth_mm = std::numeric_limits<float>::infinity();  // planar z at the pixel's centre
  // Of all that its colour was blended from: shares of cameras × confidence, 1 at most; the base
  // layer alone weighs next to nothing.
  float weight = 0;

  bool has_skin() const { return face != kNoSkin; }
};

// A drawn picture. The caller keeps it between frames: a Warper that finds its own last picture in
// it, and nothing changed, leaves it alone.
struct Frame {
  Rgb8Image color;
  std::vector<Cover> cover;     // one per pixel
  std::vector<float> depth_mm;  // planar z, +inf at the background; empty unless asked for
  // One per pixel; empty unless asked for. Tools hide no skin here, and what was filled has none.
  std::vector<BoundPixel> bound;
  bool bound_as_drawn = false;      // DrawOptions::bind_as_drawn
  std::vector<std::uint8_t> organ;  // whose skin is bound; empty: the one and only
  std::uint64_t serial = 0;         // of the drawing it holds; set to 0 to force a redraw

  // Planes of a picture of that size, whatever they hold then, to be drawn anew.
  void resize(int width, int height, bool with_depth, bool with_bound) {
    const std::size_t pixels = std::size_t(width) * height;
    serial = 0;
    color.width = width, color.height = height;
    color.pixels.resize(3 * pixels);
    cover.resize(pixels);
    depth_mm.resize(with_depth ? pixels : 0);
    bound.resize(with_bound ? pixels : 0);
    organ.clear();
  }
  bool covered(int x, int y) const {
    return cover[std::size_t(y) * color.width + x] != Cover::background;
  }
};

}  // namespace organbake
