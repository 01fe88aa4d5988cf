// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {

// A short script for organ_to_play(): the eye goes round while a probe presses where the organ
// faces camera 0.
inline Script short_script(double depth_mm) {
  const Eigen::Vector3d front = organ_to_play().cameras.manifold.directions.front();
  Script script;
  script.frames = 8;
  script.camera = {{0, {}}, {7, {0.4, 0.2, 1.1, 0.1}}};
  script.instruments = {{"probe",
                         {.radius_mm = 6},
                         {{0, std::nullopt, front, -5},
                          {0.1, std::nullopt, front, depth_mm},
                          {1, std::nullopt, front, depth_mm}}}};
  return script;
}

// The organ to play, of tetrahedra of 15 mm, held on one side of where it will be cut.
inline const Bundle& organ_to_cut() {
  static const Bundle bundle = [] {
    Bundle made = organ_to_play();
    made.mechanics.body = test::tissue_under(made.proxy, 15);
    made.mechanics.drag_per_s = 3;
    const double middle = bounds(made.proxy).center().x();
    std::erase_if(made.mechanics.body->anchors,
                  [&](std::uint32_t n) { return made.mechanics.body->nodes_mm[n].x() > middle; });
    return made;
  }();
  return bundle;
}

inline DeformOptions with_fem() {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  return options;
}

// A blade through the whole organ beside its middle, from far to near, edge upright.
inline Instrument blade_at(double share) {
  const Eigen::Vector3d center = bounds(organ_to_cut().proxy).center();
  Instrument tip;
  tip.active = true;
  tip.kind = Blade{};
  tip.radius_mm = 0.4;
  tip.position_mm = center + Eigen::Vector3d(22.3, -75 + 150 * share, -80);
  tip.axis_mm = Eigen::Vector3d(0, 0, 160);
  return tip;
}

// What was swept parts a few steps later, and then what was swept meanwhile.
inline void let_part(Player& player) {
  for (int i = 0; i < 2 * Player::kCutDelaySteps; ++i) player.step({});
}

// That blade, all the way.
inline Script cutting_script() {
  Script script;
  script.name = "cut";
  script.frames = 40;
  script.width = 160, script.height = 120;
  script.solver = TissueSolver::fem;
  script.camera = {{0, {}}, {39, {0.5, 0.2, 1.1}}};
  const Instrument scalpel = blade_at(0);
  const Eigen::Vector3d from = scalpel.position_mm, to = blade_at(1).position_mm;
  script.instruments.push_back({"scalpel", scalpel, {{0, from}, {0.5, to}}});
  return script;
}

// Of all frames' pictures.
inline std::vector<std::uint8_t> bytes_of(Player& player, const Script& script) {
  std::vector<std::uint8_t> bytes;
  play(player, script, {}, [&](int, const Frame& frame) {
    bytes.insert(bytes.end(), frame.color.pixels.begin(), frame.color.pixels.end());
  });
  return bytes;
}

}  // namespace organbake
