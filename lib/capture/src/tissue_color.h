// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/capture/solid_noise.h"
#include "organbake/capture/tissue_look.h"

namespace organbake {

// The albedo of a tissue anywhere on a surface: solid noise, so that nothing repeats and no seam
// shows, hashed per cell: the same numbers for any threads.
class TissueAlbedo {
 public:
  explicit TissueAlbedo(const TissueLook& look);

  // point: world mm; normal: unit. Linear, each channel in 0…1.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  // The size over which it hardly changes, as SurfaceColor::detail_mm().
  double detail_mm() const { return 2 * look_.grain_mm; }

 private:
  struct Lines {
    TissueVessels vessels;
    SolidNoise course, patches;
  };
  float cover_of(const Lines& lines, const Eigen::Vector3d& point,
                 const Eigen::Vector3d& normal) const;

  TissueLook look_;
  SolidNoise mottle_, fine_mottle_, tint_, grain_, fine_grain_, bend_;
  Lines large_, small_;
};

}  // namespace organbake
