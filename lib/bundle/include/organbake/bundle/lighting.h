// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace organbake {

// A light that travels with the viewer, as the fibres round a laparoscope's lens do. Skin at range
// r mm from it, off the lens's axis by the angle t and with the normal n toward the direction l of
// the light, gets (per channel, as a share of full exposure)
//   gain · (reference / r)² · b(t) · soft(n·l),   b(t) = 1 / (1 + (tan t / tan half)²)
struct ScopeLight {
  Eigen::Vector3d offset_mm = {4, -3, 0};  // from the lens: right, down, forward
  // The range of full exposure; 0: metered from each view, as a camera exposes by itself.
  double reference_mm = 0;
  double beam_half_angle_rad = 0.65;  // where the beam has half its light
  double gain = 1;

  bool operator==(const ScopeLight&) const = default;
};

// What wet tissue does with the light at the scope, beyond its albedo and the gloss lobes.
struct SkinFinish {
  // Normals finer than the mesh, bound to the skin: the root mean square of their slopes, and the
  // size of the smallest bumps. 0: smooth.
  double relief_slope = 0, relief_mm = 2;
  // Light that comes out beside where it went in (RGB): soft(c) = max(0, (c + s) / (1 + s)).
  Eigen::Vector3d softness = Eigen::Vector3d::Zero();
  // Of the surroundings' light, mirrored where skin is seen at a grazing angle (Schlick 1994).
  double rim = 0;
  // Colour finer than the maps: deviation by channel, as a share of the albedo, and the size of the
  // largest grains. 0: none.
  Eigen::Vector3d grain = Eigen::Vector3d::Zero();
  double grain_mm = 0.5;
  // Tissue from a picture ends where that was cut off: over this angle of the view it fades into
  // the background beside all that it ends against. 0: it ends sharply.
  double border_fade_rad = 0;

  static constexpr int kWidestFade_px = 15;
  // In pictures of that focal length, kWidestFade_px at most.
  int border_fade_px(double focal_px) const;

  bool operator==(const SkinFinish&) const = default;
};

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
  // The look by the light at the scope, when the bundle was made for it. Colours are in the sky's
  // and the lamps' light all the same: divided by diffuse(n) they are the albedo.
  std::optional<ScopeLight> scope;
  SkinFinish finish;  // as that light shows it

  // normal, toward_eye: unit, world.
  Eigen::Vector3d diffuse(const Eigen::Vector3d& normal) const;
  Eigen::Vector3d glossy(const Eigen::Vector3d& normal, const Eigen::Vector3d& toward_eye) const;
};

// A film of water on serosa: a lobe as narrow as a scope's light is wide (about 4° at 80 mm), of
// more than full exposure, and a faint wide one, the sheen of the tissue itself.
std::vector<Lighting::Lobe> wet_gloss();

inline constexpr const char* kLightingFile = "lighting.json";  // in a bundle

// Schema 1 where there is nothing of schema 2: a light at the scope, or a finish; that of a finish
// with grain is 3, with a fading border 4.
std::string lighting_to_json(const Lighting& lighting);
// Reads all four. Directions may have any length. Throws BadDataError naming `name` and the key:
// negative light, a direction of no length, no light at all.
Lighting lighting_from_json(const std::string& text, const std::string& name);

}  // namespace organbake
