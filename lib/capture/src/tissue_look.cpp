// SPDX-License-Identifier: GPL-3.0-or-later
// How tissues look, by name: a table with the source of each colour. What paints them by it is in
// tissue_albedo.cpp.
#include <array>
#include <stdexcept>

#include "organbake/capture/surface_color.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const std::vector<Lighting::Lobe> kWet = {{26, 750}, {0.013, 12}};
const std::vector<Lighting::Lobe> kMoist = {{1.6, 1200}, {0.05, 40}};
const std::vector<Lighting::Lobe> kGreasy = {{8, 1000}, {0.05, 40}};
// Few, small drops: more of a veil would lie on so dark a skin as a grey plate.
const std::vector<Lighting::Lobe> kMatt = {{8, 1000}, {0.013, 12}};
const std::vector<Lighting::Lobe> kCapsule = {{4, 800}, {0.15, 40}, {0.06, 12}};
// One wide, blown highlight with a soft rim on skin without bumps.
const std::vector<Lighting::Lobe> kSmooth = {{3, 300}, {0.5, 30}, {0.08, 10}};

// A camera shows of a liver what is not in the dark with a median lightness of 26 (CIE Lab; 21 to
// 27 in six frames of the clip), though brighter tissue lies beside it; all of a liver is darker.
constexpr double kOfLiver = 1.1;

// Red light goes farthest below the surface before it comes out again.
const Vector3d kSoft(0.32, 0.12, 0.1);

// Colours by source:
//  (a) medians over areas of one frame of a laparoscopy (RViMLab/endoscopy,
//  MIT; 720p, frame 180)
//      without highlights, in linear light, of the liver also with the light
//      divided out;
//  (b) the liver of (a), turned to the hue that anatomy texts describe for
//  fresh tissue: spleen more
//      purple and darker, kidney browner and lighter. No measurement;
//  (c) between the frame's ligament and its gallbladder. No measurement.
// Deviations of mottles and grain of the liver are those of (a), too: 13 % in
// red, 28 % in green.
TissueLook liver() {
  return {.albedo = {0.142f, 0.0325f, 0.034f},  // (a), by hue as it is drawn
          .tint = {-0.01f, 0.05f, 0.08f},
          .mottle = 0.17,
          .mottle_mm = 13,
          .grain = {0.034f, 0.015f, 0.016f},
          .grain_mm = 1,
          .large = {{0.30f, 0.13f, 0.14f}, 9, 0.5, 0.3, 0.5},  // of the capsule, pale
          .small = {{0.10f, 0.012f, 0.016f}, 5, 0.4, 0.35, 0.55},
          .gloss = kWet,
          .finish = {0.16, 2, kSoft, 0.12, {0.03, 0.045, 0.045}, 0.6},
          .exposure = kOfLiver};
}

TissueLook gallbladder() {
  return {.albedo = {0.84f, 0.51f, 0.355f},  // (a), over four frames, as their camera exposes
          .tint = {-0.08f, -0.04f, 0.08f},
          .mottle = 0.06,
          .mottle_mm = 15,
          .grain = {0.03f, 0.03f, 0.023f},
          .grain_mm = 0.9,
          .large = {{0.45f, 0.10f, 0.12f}, 8, 0.6, 0.75, 0.92},
          .small = {{0.45f, 0.22f, 0.27f}, 4.5, 0.8, 0.5, 0.6},  // bluish, below
          .gloss = kSmooth,
          .finish = {0.045, 2.2, kSoft, 0.12, {0.005, 0.007, 0.008}, 0.5}};
}

// Dark, matt and fine.
TissueLook spleen() {
  TissueLook look = liver();
  look.albedo = {0.095f, 0.021f, 0.028f};  // (b)
  look.grain = {0.02f, 0.009f, 0.011f};
  look.grain_mm = 0.8;
  look.mottle = 0.05;
  look.large.share = 0.1;
  look.gloss = kMatt;
  return look;
}

// Under a smooth, shining capsule.
TissueLook kidney() {
  TissueLook look = liver();
  look.albedo = {0.235f, 0.072f, 0.055f};  // (b)
  look.mottle = 0.08;
  look.tint = {-0.01f, 0.03f, 0.04f};
  look.grain = {0.014f, 0.007f, 0.006f};
  look.small = {{0.16f, 0.03f, 0.03f}, 3.5, 0.35, 0.6, 0.5};  // stellate veins
  look.large.share = 0;
  look.gloss = kCapsule;
  look.finish.relief_slope = 0.045, look.finish.relief_mm = 2.2;
  return look;
}

TissueLook stomach() {
  return {.albedo = {0.62f, 0.33f, 0.27f},  // (c)
          .tint = {-0.03f, 0.07f, 0.07f},
          .mottle = 0.07,
          .mottle_mm = 18,
          .grain = {0.04f, 0.035f, 0.03f},
          .grain_mm = 1.3,
          .large = {{0.36f, 0.09f, 0.1f}, 22, 1.5, 0.5, 0.6},  // from its two curvatures
          .small = {{0.5f, 0.2f, 0.17f}, 6, 0.4, 0.5, 0.45},
          .gloss = kWet,
          .finish = {0.16, 2.2, kSoft, 0.12, {0.02, 0.035, 0.035}, 0.6}};
}

// Paler and pinker than the stomach, its vessels in dense arcades.
TissueLook bowel() {
  TissueLook look = stomach();
  look.albedo = {0.60f, 0.30f, 0.24f};  // (c)
  look.large = {{0.36f, 0.06f, 0.07f}, 7, 0.9, 0.9, 0.7};
  look.small = {{0.48f, 0.15f, 0.13f}, 2.8, 0.3, 0.85, 0.5};
  look.gloss = kGreasy;
  return look;
}

// Smooth lobules, whose bulges strew small highlights all over.
TissueLook fat() {
  return {.albedo = {0.62f, 0.29f, 0.145f},  // (a), where it is lit
          .tint = {-0.03f, 0.08f, 0.13f},
          .mottle = 0.16,
          .mottle_mm = 15,
          .seams = 0.25,
          .grain = {0.025f, 0.019f, 0.012f},
          .grain_mm = 1.2,
          .large = {{0.26f, 0.03f, 0.03f}, 10, 0.9, 0.75, 0.95},
          .small = {{0.34f, 0.05f, 0.04f}, 4, 0.4, 0.8, 0.95},
          .gloss = {{16, 1000}, {0.05, 40}},
          .finish = {0.45, 1.3, {0.3, 0.2, 0.12}, 0.2, {0.02, 0.03, 0.04}, 0.7}};
}

// A cast training organ: even, faintly mottled pigment, moist.
TissueLook silicone() {
  return {.albedo = {0.42f, 0.13f, 0.10f},  // the plain material's
          .tint = {-0.01f, 0.02f, 0.02f},
          .mottle = 0.03,
          .mottle_mm = 20,
          .grain = {0.006f, 0.004f, 0.004f},
          .grain_mm = 1,
          .large = {},
          .small = {},
          .gloss = kMoist,
          .finish = {0.03, 4, {0.2, 0.15, 0.12}, 0.15}};
}

}  // namespace

const TissueLook& tissue_look(Tissue tissue) {
  static const std::array<TissueLook, 8> kLooks = {liver(),   gallbladder(), spleen(), kidney(),
                                                   stomach(), bowel(),       fat(),    silicone()};
  if (tissue == Tissue::plain) throw std::logic_error("tissue_look: the plain material has none");
  return kLooks[static_cast<std::size_t>(tissue) - 1];
}

}  // namespace organbake
