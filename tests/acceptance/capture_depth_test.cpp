// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "exact_depth.h"
#include "measuring/capture_scenario.h"
#include "measuring/error_measures.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/random.h"
#include "promises.h"

namespace organbake {
namespace {

// Whether a texel's ray, which meets the surface, does so at no grazing angle: those aren't kept.
bool kept_for_sure(const RayScene& scene, const SmoothNormals& normals, const Ray& ray) {
  constexpr double kLeastCosine = 0.2;
  RayHit hit;
  scene.first_hits({&ray, 1}, {&hit, 1});
  return hit.face == kNoHit || -normals.at(hit).dot(ray.direction.normalized()) > kLeastCosine;
}

TEST(CaptureDepth, IsThatOfAnExactOracle) {
  const CaptureScenario scene = capture_scenario(8, 1024);
  const CaptureResult captured =
      capture(scene.surface, scene.proxy, scene.cameras, *make_vertex_color(scene.surface), {});
  constexpr int kTexels = 10'000;
  constexpr std::uint64_t kSeed = 6;
  const ExactDepth oracle(scene.surface);
  const RayScene rays(scene.surface);
  const SmoothNormals normals(scene.surface);
  RandomStream random(kSeed);
  double worst = 0;
  int met = 0, met_by_one = 0;
  while (met < kTexels) {
    const std::size_t c = random.below(scene.cameras.size());
    const CameraMaps& maps = captured.maps[c];
    const std::size_t texel = random.below(maps.face.size());
    const Ray ray = texel_ray(scene.cameras[c], texel);
    const double exact = oracle.first_hit(ray.origin, ray.direction);
    const bool ours = std::isfinite(maps.depth_mm[texel]);
    if (ours != std::isfinite(exact) && (ours || kept_for_sure(rays, normals, ray))) ++met_by_one;
    if (!ours || !std::isfinite(exact)) continue;
    worst = std::max(worst, std::abs(maps.depth_mm[texel] - exact) / exact);
    ++met;
  }
  expect({"depth at 10,000 texels' centres against CGAL, worst", "of the depth", worst, 1e-5});
  expect(
      {"texels that only one of both says are hit, grazing ones aside", "", double(met_by_one), 0});
}

}  // namespace
}  // namespace organbake
