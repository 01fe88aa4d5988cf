// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>

#include "organbake/capture/solid_noise.h"
#include "organbake/capture/tissue_look.h"
#include "vessel_tile.h"

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
  struct Vessels {
    TissueVessels look;
    SolidNoise patches;
    std::shared_ptr<const VesselTile> tile;  // none: no vessels
  };
  static Vessels make_vessels(const TissueVessels& look, std::uint64_t seed);
  static float cover_of(const Vessels& vessels, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& normal);

  TissueLook look_;
  std::array<SolidNoise, 3> mottles_;
  SolidNoise tint_, grain_, fine_grain_, bend_;
  Vessels large_, small_;
};

}  // namespace organbake
