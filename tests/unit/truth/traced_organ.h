// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/truth/pixel_truth.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {

// A lumpy organ with maps as fine as bundles have them (texels of 0.33 mm), and the mesh it is made
// from: what the pixels of its pictures must be.
const Bundle& traced_organ();
const CarriedSurface& traced_surface();

// The truth of one picture, by following each pixel's ray to the carried surface.
struct Traced {
  int width = 0, height = 0;
  std::vector<CarriedSurface::Seen> seen;
  std::vector<float> depth_mm;          // +inf at the background
  std::vector<Eigen::Vector3d> normal;  // camera axes
  std::vector<bool> outline;  // within two pixels of where the surface ends, or hides itself

  bool covered(std::size_t pixel) const { return depth_mm[pixel] < kNothing; }
  static constexpr float kNothing = std::numeric_limits<float>::infinity();
};
Traced traced(const std::vector<Eigen::Vector3d>& carried, const View& view);

// Whether a view sees points of the carried surface: inside the picture, with nothing before them.
class Sight {
 public:
  Sight(const std::vector<Eigen::Vector3d>& carried, const View& view);
  bool sees(const Eigen::Vector3d& point) const;

 private:
  View view_;
  RayScene scene_;
};

// A player that pokes the organ where it faces camera 0, so deep (mm).
void poke(Player& player, double depth_mm);

// Draws and advances; the picture is returned.
Rgb8Image draw_with_truth(Player& player, const View& view, const std::vector<Solid>& solids,
                          TruthTracker& tracker);

double intersection_over_union(const std::vector<bool>& a, const std::vector<bool>& b);

}  // namespace organbake
