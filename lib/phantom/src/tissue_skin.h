// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "tissue_relief.h"

namespace organbake {

// What lies on a TissueRelief, bound to its points: colours mottled from 0.3 to 5 mm, vessels that
// branch (0.15 to 2 mm wide) and a net of fine ones, and the film's unevenness that breaks mirror
// reflections up.
class TissueSkin {
 public:
  // `mottling`: the standard deviation of the albedo, as a share; 0 = even colours, no vessels.
  TissueSkin(const TissueRelief& relief, std::uint64_t seed, double mottling);

  struct Sample {
    Eigen::Vector3d albedo;     // linear
    Eigen::Vector2d film_tilt;  // slopes by which the film departs from the relief's, along x and y
  };
  // At a point of the relief at rest.
  Sample at(double x_mm, double y_mm) const;

 private:
  // Shares of full scale; a tilt's from -1 to 1.
  struct Texel {
    std::array<std::uint16_t, 3> albedo;
    std::array<std::int16_t, 2> tilt;
  };
  static Texel texel(const TissueRelief& relief, double x_mm, double y_mm, std::uint64_t seed,
                     double mottling, double vessel);
  void paint_vessels(std::uint64_t seed, std::vector<float>& coverage) const;

  int columns_, rows_;
  std::vector<Texel> texels_;
};

}  // namespace organbake
