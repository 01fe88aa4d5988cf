// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/mesh_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/geometry/area_sampler.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

constexpr std::size_t kBlock = 512;  // samples summed in one go; fixes the order of summation

struct Sums {
  double sum = 0, sum2 = 0, max = 0;
  void add(double distance) {
    sum += distance;
    sum2 += distance * distance;
    max = std::max(max, distance);
  }
  void add(const Sums& other) {
    sum += other.sum;
    sum2 += other.sum2;
    max = std::max(max, other.max);
  }
};

}  // namespace

MeshDistance mesh_distance(const TriangleMesh& from, const TriangleMesh& to, std::size_t samples,
                           std::uint64_t seed, const RunContext& context) {
  check_mesh(from, "mesh to measure from");
  samples = std::max<std::size_t>(samples, 1);
  const AreaSampler sample(from, samples, seed);
  const RayScene scene(to);
  std::vector<Sums> blocks((samples + kBlock - 1) / kBlock);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    context.throw_if_cancelled();
    for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, samples); ++i) {
      blocks[b].add(scene.closest_point(sample(i)).distance_mm);
    }
  });
  Sums all;
  for (const Sums& block : blocks) all.add(block);
  return {all.sum / samples, std::sqrt(all.sum2 / samples), all.max};
}

}  // namespace organbake
