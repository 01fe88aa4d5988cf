// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

class Bench;

// The phantom organ, coloured, its proxy, and virtual cameras round it.
struct CaptureScenario {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
};

// An empty folder, made anew.
std::filesystem::path new_folder(const std::filesystem::path& folder);

// Sizes and packings of maps, and what a player makes of them against the surface that was baked.
void sweep_packings(Bench& bench, const CaptureScenario& scene);

}  // namespace organbake
