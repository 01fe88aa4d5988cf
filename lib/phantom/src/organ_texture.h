// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organ_shape.h"
#include "organbake/capture/solid_noise.h"

namespace organbake {

// The organ's albedo as a solid texture: no seams, and its formula is the truth at every point.
// From the bottom: two tissue tones in slow drifts; lobules of 2–5 mm with paler walls; fine
// mottling; a pale and a dark network of vessels (bands along zero sets of noise); fat spots; and
// one green gallbladder that tells left from right at a glance. No detail is narrower than 1.5 mm.
class OrganTexture {
 public:
  OrganTexture(std::uint64_t seed, const OrganShape& shape);

  // Linear RGB in 0…1.
  Eigen::Vector3d albedo(const Eigen::Vector3d& world_mm) const;

 private:
  struct Spot {
    Eigen::Vector3d offset_mm;  // from the centre
    double radius_mm;
  };
  Eigen::Vector3d tissue(double drift, double lobule, double mottle) const;
  double fat(const Eigen::Vector3d& offset_mm, double ragged) const;
  double gallbladder(const Eigen::Vector3d& offset_mm, double ragged) const;

  Eigen::Vector3d center_mm_;
  double scale_;
  SolidNoise drift_, lobules_, mottling_, dark_vessels_, pale_vessels_, visibility_;
  std::vector<Spot> fat_spots_;
  Eigen::Vector3d gallbladder_at_mm_, gallbladder_axis_;
};

}  // namespace organbake
