// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture_scene.h"

#include "organbake/decimate/decimate.h"
#include "organbake/phantom/phantom.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

CaptureScene capture_scene(int cameras, int map_size) {
  CaptureScene scene;
  scene.surface = OrganPhantom({}).surface(6);
  scene.proxy = decimate(scene.surface, {}).proxy;
  PlacementOptions options;
  options.count = cameras;
  options.map_size = map_size;
  scene.cameras = place_cameras(scene.surface, options).cameras;
  return scene;
}

}  // namespace organbake
