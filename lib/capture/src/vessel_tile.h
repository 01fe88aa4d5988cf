// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace organbake {

// Vessels on a square that repeats: trees that branch and taper, grown by space colonisation
// (Runions, Lane and Prusinkiewicz 2007, "Modeling Trees with a Space Colonization Algorithm"; of
// leaves, 2005): points that want blood pull the nearest tip a step nearer, until one reaches them.
// A vessel's width follows Murray's law: the cube of a parent's is the sum of its children's.
struct VesselTreeOptions {
  double side_mm = 64;
  double spacing_mm = 6;  // between twigs, about
  double width_mm = 0.5;  // of the widest
  int trees = 3;
  std::uint64_t seed = 1;
};

// Its picture, to look up anywhere on the plane.
class VesselTile {
 public:
  explicit VesselTile(const VesselTreeOptions& options);

  // How much of the place vessels cover, 0…1; half of a vessel's border.
  float cover(const Eigen::Vector2d& place_mm) const;

 private:
  static constexpr int kSide = 1024;
  void draw(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double from_width_mm,
            double to_width_mm);

  double pixels_per_mm_;
  std::vector<float> cover_;  // kSide², rows of y
};

}  // namespace organbake
