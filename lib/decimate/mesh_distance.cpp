// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimate/mesh_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "geometry/mesh_checks.h"
#include "raycast/ray_scene.h"

namespace organbake {
namespace {

constexpr std::size_t kBlock = 512;  // samples summed in one go; fixes the order of summation

std::vector<double> cumulative_areas(const TriangleMesh& mesh) {
  std::vector<double> cumulative(mesh.faces.size());
  double sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) cumulative[f] = sum += face_area(mesh, f);
  return cumulative;
}

class AreaSampler {
 public:
  AreaSampler(const TriangleMesh& mesh, std::size_t samples, std::uint64_t seed)
      : mesh_(mesh), cumulative_(cumulative_areas(mesh)), samples_(samples), seed_(seed) {
    if (mesh.empty() || !(cumulative_.back() > 0) || !std::isfinite(cumulative_.back())) {
      throw BadDataError("mesh to measure from: its faces have no (finite) area");
    }
  }

  // Sample i lies in the i-th of equal slices of the area (stratification), at random in its face.
  Eigen::Vector3d operator()(std::size_t i) const {
    RandomStream random(seed_, i);
    const double target = (i + random.uniform()) / samples_ * cumulative_.back();
    const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, target);
    const Face& face = mesh_.faces[found - cumulative_.begin()];
    const double r = std::sqrt(random.uniform()), s = random.uniform();
    return (1 - r) * mesh_.vertices[face[0]] + r * (1 - s) * mesh_.vertices[face[1]] +
           r * s * mesh_.vertices[face[2]];
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<double> cumulative_;
  std::size_t samples_;
  std::uint64_t seed_;
};

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
