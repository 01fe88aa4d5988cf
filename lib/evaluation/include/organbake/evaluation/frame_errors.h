// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/carried_surface.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"

namespace organbake {

struct PixelErrors {
  double mean_px = 0, nearly_all_px = 0, max_px = 0;  // nearly: 999 of 1,000 are no larger
  std::size_t vertices = 0;  // that were measured; of a displayed error, pixels
};

// One row of the paper's Table 1: how far original vertices land from where they belong.
struct ProjectionErrors {
  std::size_t visible = 0;  // original vertices that the view sees
  PixelErrors image_based;
  PixelErrors polygons;
  std::size_t without_map = 0;  // visible in the view, yet in none of its three cameras' maps
};

// Compares image-based and polygonal drawing with the truth, geometrically (before any rounding to
// pixels; the paper, 3.2). Image-based: each visible original vertex is looked up bilinearly in the
// depth map of the heaviest of the view's three cameras that see it (share × confidence, as pixels
// are blended, and no more confidence than the piece between its texels deserves by its tilt), the
// surface point found there is bound, carried and projected. Polygons: each
// vertex is replaced by its closest point on the shell's surface at rest, the proxy or its smooth
// skin, whose own triangle carries it.
class ProjectionComparison {
 public:
  // Both must outlive the comparison; every map of the bundle must have been read.
  ProjectionComparison(const Bundle& bundle, const CarriedSurface& truth);

  ProjectionErrors measure(const std::vector<Eigen::Vector3d>& proxy_positions,
                           const View& view) const;

  // How far the skin that a frame's pixels show belongs from their centres: each pixel of
  // Cover::samples in a frame drawn with keep_bound, the point whose colour it has,
  // carried and projected anew.
  PixelErrors displayed(const Frame& frame, const std::vector<Eigen::Vector3d>& proxy_positions,
                        const View& view) const;

 private:
  struct OnFace {
    std::uint32_t face = 0;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  };
  OnFace closest_to(const Eigen::Vector3d& point) const;
  // The baked surface point, world at rest, at an original vertex as one camera's map has it, and
  // the map's confidence there. False when the camera does not see the vertex.
  struct Found {
    Eigen::Vector3d world_mm = Eigen::Vector3d::Zero();
    double confidence = 0;
  };
  bool look_up(std::size_t vertex, std::size_t camera, Found& found) const;
  // The same by the camera that counts most there, by share × confidence, as pixels are blended.
  bool look_up(std::size_t vertex, const ViewWeights& shares, Eigen::Vector3d& world_mm) const;

  const Bundle& bundle_;
  const CarriedSurface& truth_;
  ShellSurface shell_;
  ShellBinder binder_;
  std::vector<OnFace> closest_;  // of every vertex, on the shell's surface at rest
};

// Colour steps in 8-bit sRGB, the largest of the three channels.
struct SeamSteps {
  double frame = 0;   // the largest step in the frame
  double truth = 0;   // the largest step in the truth
  double excess = 0;  // the largest |step in the frame| − |step in the truth| of one place
  std::size_t places = 0;
};

// Steps across the proxy's edges: along the picture of each edge, pixel pairs of which one shows
// one face and the other the other are averaged, signed, so that texture cancels and a seam stays.
// The truth is its sharp picture: averaging a pixel's rays would soften the steps that its own
// texture and folds make, and a frame is not averaged. Edges with fewer than 40 pairs are too short
// to tell. All pictures have one size.
SeamSteps edge_steps(const Rgb8Image& frame, const TruthFrame& truth);

// Steps in time, when the set of active cameras changes between two views that hardly differ: means
// of 8×8 pixel blocks that both pictures cover, before against after.
SeamSteps switch_steps(const Rgb8Image& before, const Rgb8Image& after,
                       const TruthFrame& truth_before, const TruthFrame& truth_after);

}  // namespace organbake
