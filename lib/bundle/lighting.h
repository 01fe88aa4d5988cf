// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace organbake {

// The light that a bundle's colours were taken in, as far as a player needs it to light the
// deformed skin anew: a sky and distant lamps, fixed in the world, without shadows. Linear RGB.
//   diffuse(n)  = below + (above − below) (1 + n·up) / 2 + Σ lamp max(0, n·l)
//   gloss(n, e) = Σ lamp Σ strength max(0, n·h)^exponent over lamps with n·l > 0, h half-way
//                 between l and the direction e to the eye (Blinn 1977)
// What the eye gets of skin of albedo a is a ∘ diffuse + gloss.
struct Lighting {
  struct Lamp {
    Eigen::Vector3d toward;  // surface → lamp, unit, world
    Eigen::Vector3d color;
  };
  struct Lobe {
    double strength = 0, exponent = 1;
  };
  Eigen::Vector3d ambient_above = Eigen::Vector3d::Zero();
  Eigen::Vector3d ambient_below = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  std::vector<Lamp> lamps;
  std::vector<Lobe> gloss;  // none: matt

  // normal, toward_eye: unit, world.
  Eigen::Vector3d diffuse(const Eigen::Vector3d& normal) const;
  Eigen::Vector3d glossy(const Eigen::Vector3d& normal, const Eigen::Vector3d& toward_eye) const;
};

inline constexpr const char* kLightingFile = "lighting.json";  // in a bundle

std::string lighting_to_json(const Lighting& lighting);
// Directions may have any length. Throws BadDataError naming `name` and the key: negative light, a
// direction of no length, no light at all.
Lighting lighting_from_json(const std::string& text, const std::string& name);

}  // namespace organbake
