// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/capture_scenario.h"

#include "organbake/decimate/decimate.h"
#include "organbake/phantom/phantom.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

CaptureScenario capture_scenario(int cameras, int map_size, int subdivisions) {
  CaptureScenario scene;
  scene.surface = OrganPhantom({}).surface(subdivisions);
  scene.proxy = decimate(scene.surface, {}).proxy;
  scene.cameras = place_cameras(scene.surface, {.count = cameras, .map_size = map_size}).cameras;
  return scene;
}

std::filesystem::path empty_folder(const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace organbake
