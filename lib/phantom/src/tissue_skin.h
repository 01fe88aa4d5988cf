// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/capture/surface_color.h"
#include "tissue_relief.h"

namespace organbake {

// What lies on a TissueRelief, bound to its points: the colours of the materials liver, gallbladder
// and fat, vessels that branch (0.1 to 1.1 mm wide) and a net of fine ones, and the film's
// unevenness that breaks mirror reflections up.
class TissueSkin {
 public:
  // `mottling`: how much the albedo varies, 0.1 as the materials do; 0 = even colours, no vessels.
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
  using Materials = std::array<std::unique_ptr<SurfaceColor>, 3>;
  void paint_row(const TissueRelief& relief, int row, std::uint64_t seed, double mottling,
                 const Materials& materials, const float* vessels);
  static Texel texel(const TissueRelief& relief, const Eigen::Vector3d& point, std::uint64_t seed,
                     double mottling, const std::array<Eigen::Vector3f, 3>& colors, double vessel);
  void paint_vessels(std::uint64_t seed, std::vector<float>& coverage) const;

  int columns_, rows_;
  std::vector<Texel> texels_;
};

}  // namespace organbake
