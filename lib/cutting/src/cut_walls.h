// SPDX-License-Identifier: Apache-2.0
#pragma once

// The walls of a cut, and what the inside of the tissue looks like.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cut_skin.h"

namespace organbake {

// The walls of cuts at rest: both sides of each, from the skin's border down to where the blade's
// edge ended or left the tissue.
struct CutWalls {
  struct Vertex {
    Eigen::Vector3d at_mm;
    Eigen::Vector3d side_mm;  // beside the cut, in the tissue whose wall it is
    std::uint32_t lip;        // the skin's vertex at the wall's lip above
    double depth_mm;          // below the skin
    float light = 1;          // of what falls on the skin, the share that comes down there
  };
  std::vector<Vertex> vertices;
  std::vector<Face> faces;  // outward: away from that tissue
};

CutWalls cut_walls(const CutSkin& skin, const CutSheet& sheet);

// How far a place at rest lies from the wall of a vessel, mm, below 0 within: most cubes of some
// millimetres have one, along an axis of its own.
double from_vessel_mm(const Eigen::Vector3d& at_mm);
// −1…1, smooth between the cells of a grid of side 1 (value noise).
double tissue_noise(const Eigen::Vector3d& at);

// The albedo (linear RGB) of tissue on the inside, at a place at rest, so far below the skin: a
// thin capsule, a rim wet with blood, then that of the skin, darker and redder, mottled and with
// fibres, and of what is alive with its lobules or vessels: the same wherever a cut comes by.
Eigen::Vector3f inner_albedo(const Eigen::Vector3d& at_mm, double depth_mm,
                             const Eigen::Vector3f& skin_albedo, bool alive);

}  // namespace organbake
