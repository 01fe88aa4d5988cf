// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame on one level of a pyramid, as it is matched (shading/grid_filters.h).
struct SweepView {
  PosedCamera camera;
  Plane pattern;
  Mask counts;
};

// The depths that are tried: at each pixel inverse depths base + k · step, k = 0 … count − 1. A
// base that follows the surface makes windows that lie on it, however slanted.
struct InverseDepthLabels {
  Plane base;
  float step = 0;
  int count = 0;
};

// What each label of each pixel costs, 0 (all alike) … kWorst, the labels of a pixel side by side.
struct CostVolume {
  static constexpr std::uint8_t kWorst = 250;
  int width = 0, height = 0;
  int labels = 0;
  std::vector<std::uint8_t> costs;

  const std::uint8_t* at(int x, int y) const {
    return &costs[(std::size_t(y) * width + x) * std::size_t(labels)];
  }
};

inline constexpr int kWindowRadius_px = 5;  // of the correlation

// 1 − NCC of the patterns (Lewis 1995), what does not count left out, as the mean of the best
// neighbours: those that see the pixel's surroundings unhidden. Where no neighbour sees enough of a
// window all labels cost the same.
CostVolume neighbour_costs(const SweepView& reference, const std::vector<SweepView>& neighbours,
                           const InverseDepthLabels& labels);

// Sums of the costs with what neighbours ask for, along eight directions (semi-global matching,
// Hirschmüller 2008). Labels of a pixel side by side, as in the volume.
std::vector<std::uint16_t> aggregated(const CostVolume& volume, const Plane& grey);

// A frame of a clip, of the size at which it is matched. Lengths are in the unit of the poses:
// millimetres, or whatever a reconstruction of unknown scale has.
struct PosedFrame {
  PosedCamera camera;  // without distortion, which is undone in the picture
  Plane intensity;     // grey levels as coded in sRGB, 0…255: noise is alike in dark and bright
  Mask counts;         // tissue that is neither highlight nor instrument
};

// `lens` is of the whole picture, whose size is halved this often.
PosedFrame posed_frame(const ClipPicture& frame, const Intrinsics& lens, int halvings,
                       const RigidTransform& camera_from_world);

struct DepthRange {
  double nearest = 0, farthest = 0;  // planar z, in the unit of the poses
};

// What parallax tells of one frame.
struct SweptDepth {
  Plane depth;        // planar z; +inf where nothing is known
  Plane relative_sd;  // of the depth, from the width of the correlation's maximum
  Plane confidence;   // 0…1: how surely the match is the right one
};

// Depth of `reference` by plane sweep (Collins 1996) over inverse depth: correlations with the
// neighbours, the best of each pixel (hidden places drop out), made smooth along the picture by
// semi-global matching, from coarse to fine; on finer levels the sweep follows the coarser one's
// surface, so that windows lie on it. Frames may be of different sizes and lenses; there is at
// least one neighbour. `coarsest_px`: the longest side that the whole range is tried at, at most.
SweptDepth sweep_depth(const PosedFrame& reference,
                       const std::vector<const PosedFrame*>& neighbours, const DepthRange& range,
                       const RunContext& context = {}, int coarsest_px = 340);

struct NeighbourOptions {
  int most = 8;
  double least_angle_rad = 0.012;  // between the rays to one point: less tells little of depth
  // Frames that lie farther off in the list count less: tissue moves meanwhile. 0 = time says
  // nothing.
  double usual_gap = 0;
};

// The frames whose rays meet the reference's at the best angles at this depth, from as many sides
// as there are; the best first, fewer than asked for where others are too near, too far or look
// elsewhere.
std::vector<std::size_t> best_neighbours(const std::vector<PosedCamera>& cameras,
                                         std::size_t reference, double depth,
                                         const NeighbourOptions& options = {});

// Holds the depths of several frames against each other, each one's against its partners'
// (indices): confidence rises where partners have the surface at the same place, and falls where it
// would hide what they see. Where no partner looks it stays. All swept[i] are of cameras[i].
void check_agreement(const std::vector<PosedCamera>& cameras,
                     const std::vector<std::vector<std::size_t>>& partners,
                     std::vector<SweptDepth>& swept);

// Depth that partners are sure of, where a frame itself is not: a partner's pixel that falls there
// lends its depth with a part of its confidence, the surest first. What hides or is hidden is as
// the frames agreed (check_agreement comes before). All swept[i] are of cameras[i].
void borrow_depth(const std::vector<PosedCamera>& cameras,
                  const std::vector<std::vector<std::size_t>>& partners,
                  std::vector<SweptDepth>& swept);

// Depth of one frame from parallax and shading in one solve: ln r is held to the swept depth where
// that is certain (robustly: what a smooth surface cannot follow is let go) and bends between so
// that the picture under the lamp at the lens is explained. The albedo's slow changes are free, so
// that only what is short comes from brightness. The depth is in the swept depth's unit, `metric`
// is the caller's to say. confidence: the certainty of parallax near the pixel. `reach_share`: of
// the width, how far shading reaches from where parallax is sure; farther off there is no depth.
// Throws BadDataError when nothing is certain.
FrameDepth fill_by_shading(const PreparedFrame& frame, const SweptDepth& swept,
                           double reach_share = 0.12);

}  // namespace organbake
