// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "organbake/bundle/bundle.h"
#include "organbake/warp/view.h"

namespace organbake {

// Where to poke an organ that nobody has seen: the first direction of its cameras in which a line
// from its centre meets skin; an organ bent round its centre has none on its open side. Throws
// BadDataError when there is none at all.
Eigen::Vector3d poke_direction(const Bundle& bundle);

// Where a tool is to press so that a view shows its dent.
struct PokeSite {
  Eigen::Vector3d skin_mm;  // at rest
  Eigen::Vector3d outward;  // unit, of the skin round about: a tool comes from there
  double thickness_mm;      // of the organ behind it, or of a sheet a quarter of its extent
};
// Skin that the view sees, a little from aside, near its middle, in no groove and away from
// anchors and borders, for a tip of a radius. Where the view sees none, what poke_direction()
// tells.
PokeSite poke_site(const Bundle& bundle, const View& view, double radius_mm);

// The organ's thickness along a line through its centre. A sheet of tissue, as a laparoscope sees
// it, has no far side: a quarter of its extent stands for how deep it may be pressed. Throws
// BadDataError when there is no skin in the direction.
double thickness_mm(const Bundle& bundle, const Eigen::Vector3d& direction);

// The place where a line from the organ's centre along a direction leaves the skin at rest (the
// base layer's lattice over the proxy). Throws BadDataError when it meets none.
struct SkinPlace {
  Eigen::Vector3d skin_mm;
  bool from_behind;  // the line meets an open sheet there, from the side that it does not face
};
SkinPlace skin_place(const Bundle& bundle, const Eigen::Vector3d& direction);

}  // namespace organbake
