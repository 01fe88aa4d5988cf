// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The phantom organ of 20 · 4^subdivisions faces, coloured, its proxy, and virtual cameras round
// it.
struct CaptureScenario {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
};
CaptureScenario capture_scenario(int cameras, int map_size, int subdivisions = 6);

// An empty folder, made anew.
std::filesystem::path empty_folder(const std::filesystem::path& folder);

}  // namespace organbake
