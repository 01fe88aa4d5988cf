// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "organbake/bundle/lighting.h"

namespace organbake {

// `plain` is noise of two sizes on one albedo, matt; the others are what a scope shows of organs.
enum class Tissue : std::uint8_t {
  plain,
  liver,
  gallbladder,
  spleen,
  kidney,
  stomach,
  bowel,
  fat,
  silicone
};

// Vessels that branch and taper along a tissue's surface, and come and go.
struct TissueVessels {
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  // linear
  double spacing_mm = 10, width_mm = 0.4;           // of twigs, about; of the widest
  double share = 0;                                 // of the surface on which they show, 0…1
  double cover = 0;                                 // of the colour below, 0…1
};

// How one tissue looks. Albedo varies by slow mottles of brightness and of tint, and by a grain.
struct TissueLook {
  Eigen::Vector3f albedo;      // linear, 0…1: the median
  Eigen::Vector3f tint;        // what mottles of colour multiply by 1 ± of, standard deviations
  double mottle = 0;           // standard deviation of the slow brightness, as a share
  double mottle_mm = 10;       // its size
  Eigen::Vector3f grain;       // linear, added where the grain is brightest, taken where darkest
  double grain_mm = 1;         // of the largest grains
  TissueVessels large, small;  // small ones lie below
  std::vector<Lighting::Lobe> gloss;
  SkinFinish finish;
};

// Of any but Tissue::plain. Where each colour comes from stands beside it.
const TissueLook& tissue_look(Tissue tissue);

}  // namespace organbake
