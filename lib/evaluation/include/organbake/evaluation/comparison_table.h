// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
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

struct CompareOptions {
  // The paper's Table 1: rotations about the organ's vertical axis from camera 0.
  std::vector<double> angles_rad = {0.705723, 0.867709, 1.91832, 2.44696, 2.44881};
  static constexpr int kSmallestSide_px = 16, kLargestSide_px = 4096;
  int size_px = 512;
  static constexpr double kPokeShare = 0.3;  // of the organ's thickness
};

// A picture against the 16-ray truth, over the union of both silhouettes.
struct PictureErrors {
  double psnr_db = 0, ssim = 0;
  std::size_t holes = 0;  // of the truth's inner pixels, uncovered
};

// One viewing angle in one state.
struct ComparisonRow {
  double angle_rad = 0;
  bool poked = false;
  ProjectionErrors projection;
  PixelErrors displayed;  // of the skin that pixels show (ProjectionComparison::displayed)
  PictureErrors picture;
  PictureErrors paper;  // of the paper's own warp, its outline smoothed as the player's is
  // Of the best picture that the maps allow, one sample a pixel (ideal_picture()), its outline
  // smoothed likewise.
  PictureErrors ideal;
  // Pixels that the truth covers with all their neighbours, and those of them that are filled.
  std::size_t inner_pixels = 0, filled_pixels = 0;
  SeamSteps seams;
};

struct ComparisonTable {
  std::vector<ComparisonRow> rows;  // every angle at rest, then every angle poked
  SeamSteps camera_switch;          // the worst over the triangles' edges that the orbit crosses
  std::size_t switches = 0;
};

// Compares what the player draws with the truth that its bundle carries (surface.ply): the paper's
// 3.2. The player must have been loaded with its maps kept. Throws BadDataError without a surface.
ComparisonTable compare_with_truth(Player& player, const TriangleMesh& surface,
                                   const CompareOptions& options, const RunContext& context = {});

std::string comparison_json(const ComparisonTable& table);
std::string comparison_text(const ComparisonTable& table);

// The best picture that the bundle's maps allow: at each pixel's centre the exact point of the
// carried surface, its colour read from the same cameras' maps by Catmull–Rom interpolation in
// linear light, blended as the warp blends. Where none of the view's cameras sees the point, any
// other that does; where none does, the truth's own colour. The ceiling for any warp of the maps.
// Every map must have been read.
Rgb8Image ideal_picture(const Bundle& bundle, const CarriedSurface& truth,
                        const std::vector<Eigen::Vector3d>& proxy_positions, const View& view,
                        const std::array<std::uint8_t, 3>& background);

}  // namespace organbake
