// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"

namespace organbake {

// An instrument's part, world millimetres: all that lies within the radius of a segment, a point
// (both ends agree) or, with a third corner, a triangle: a capsule, a sphere or a rounded plate.
struct Solid {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double radius_mm = 1;
  std::optional<Eigen::Vector3d> corner = {};
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.35f);  // linear
  std::uint32_t instrument = 0;                              // that it is a part of
  // How it has pressed skin in from rest, world mm: in what direction, and how deep.
  Eigen::Vector3d pressed_mm = Eigen::Vector3d::Zero();

  bool operator==(const Solid& other) const = default;
};

// Skin that a grasper's jaws draw together into a ridge. It is shorter than the edges of the mesh
// that the tissue is reckoned on, so it is there in pictures alone. World, mm.
struct SkinFold {
  Eigen::Vector3d middle_mm;       // of the skin, before it is drawn together
  Eigen::Vector3d along, outward;  // unit: the ridge's, and across it to where it rises
  double reach_mm = 0;             // from its middle to its foot
  double closed = 0;               // 0: as the skin lies … 1

  bool operator==(const SkinFold& other) const = default;
};

// A block of the picture's pixels, of eight by eight at most, and the numbers of what may be seen
// in it.
struct PictureBlock {
  PixelBox box;
  std::vector<std::uint32_t> numbers;
};

// The same solids, wider by how far from skin they still shade it by the light at the scope, and by
// the dents that they press: for solid_blocks().
std::vector<Solid> with_shadows(std::vector<Solid> solids);

// All blocks that the solids may touch.
std::vector<PictureBlock> solid_blocks(const std::vector<Solid>& solids, const View& view);

// Draws solids lit from the eye into their blocks of a frame that keeps its depth, hidden where
// tissue is nearer; edges are smoothed with 2 × 2 rays a pixel. in_cavity: as the light at the
// scope shows them amid tissue.
void draw_solids(const std::vector<Solid>& solids, const std::vector<PictureBlock>& blocks,
                 const View& view, bool in_cavity, Frame& frame);
// What steel that faces the lamp sends back by the light at the scope, of its colour's square.
inline constexpr float kSteelLit = 0.4f;
// Of its own light, what the tissue round about sends to a tool, RGB.
inline constexpr std::array<float, 3> kTissueMirrored = {0.3f, 0.08f, 0.06f};

// What the ray through a pixel's centre meets first of the solids.
struct SolidSeen {
  std::uint32_t solid = 0;  // its place in the list
  float depth_mm = 0;       // planar z
  Eigen::Vector3f normal;   // camera axes, unit, outward
};

// Calls visit(x, y, seen) for every pixel whose centre a solid lies at, from several threads at
// once, each pixel one time. Whether something else lies before it is the caller's to ask.
void trace_solids(const std::vector<Solid>& solids, const View& view,
                  const std::function<void(int, int, const SolidSeen&)>& visit);

}  // namespace organbake
