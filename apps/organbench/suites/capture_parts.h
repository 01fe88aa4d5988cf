// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "bench.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

// The suite of capture, by what it measures.
namespace organbake {

// The phantom organ, coloured, its proxy, and virtual cameras round it.
struct CaptureScenario {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
};
CaptureScenario capture_scenario(const Bench& bench, int cameras, int map_size);

// An empty folder in the suite's, made anew.
std::filesystem::path fresh_folder(const Bench& bench, const std::string& name);

// Trace, bind and write beside Embree's trace and OpenEXR's write alone; the price of a binding.
void promise_capture_time(Bench& bench);
// Depth against an exact oracle, macro + micro against the surface, sizes and packings.
void promise_capture_maps(Bench& bench);
// Colour from six photographs against the true albedo; nothing bleeds across an occluder.
void promise_capture_color(Bench& bench);
// A pushed phantom lit anew against the light that was baked.
void promise_capture_light(Bench& bench);

}  // namespace organbake
