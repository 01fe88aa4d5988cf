// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/evaluation/frame_errors.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "organbake/warp/view.h"

namespace organbake {

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
