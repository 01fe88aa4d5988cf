// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"
#include "suites/baker.h"

namespace organbake {

// One scene, worked through twice: everything, and without what may be left out.
struct SkipScene {
  std::string name;
  std::function<void()> whole, skipping;
  // Of the two results: bytes (or voxels, pixels, files) that are not the same.
  std::function<double()> different;
};

// Adds both as points, and that nothing differs as a promise; how many times faster it was.
double add_skip_scene(Bench& bench, const SkipScene& scene);

void skip_baking(Bench& bench, const Baker& baker);
void skip_volume(Bench& bench);
void skip_frames(Bench& bench, const std::filesystem::path& bundle);

}  // namespace organbake
