// SPDX-License-Identifier: GPL-3.0-or-later
// Which patches of a surface are its outside: by how much of either side rays reach from outside.
// It asks nothing of the surface's topology, which is what is broken.
#include "patches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/rotation_between.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

constexpr std::size_t kDirections = 32;     // a side, evenly over the half sphere
constexpr std::size_t kFacesOfPatch = 200;  // at most, spread over it
// Off the surface by more than the ray tracer's margin, 4e-6 of the size.
constexpr double kOff = 2e-5;

// Fibonacci's points on the half sphere round +z.
std::vector<Eigen::Vector3d> half_sphere() {
  std::vector<Eigen::Vector3d> all;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / kDirections;
    const double angle = static_cast<double>(i) * M_PI * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    all.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return all;
}

double free_share(const RayScene& scene, const Eigen::Vector3d& point,
                  const Eigen::Vector3d& normal, double off_mm) {
  static const std::vector<Eigen::Vector3d> directions = half_sphere();
  const Eigen::Quaterniond turn = rotation_between(Eigen::Vector3d::UnitZ(), normal);
  std::vector<Ray> rays(kDirections);
  for (std::size_t i = 0; i < kDirections; ++i) {
    rays[i].origin = point + off_mm * normal;
    rays[i].direction = turn * directions[i];
  }
  std::vector<std::uint8_t> blocked(kDirections);
  scene.occluded(rays, blocked);
  return static_cast<double>(std::count(blocked.begin(), blocked.end(), 0)) / kDirections;
}

}  // namespace

Patches patches_of(const TriangleMesh& mesh) {
  UnionFind joined(mesh.faces.size());
  std::vector<std::uint32_t> crowded;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 2) joined.join(uses[0].face(), uses[1].face());
    if (uses.size() <= 2) return;
    for (const EdgeUse& use : uses) crowded.push_back(use.face());
  });
  Patches patches;
  std::vector<std::uint32_t> number(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const std::uint32_t root = joined.root(f);
    if (root == f) number[f] = static_cast<std::uint32_t>(patches.count++);
    patches.of_face.push_back(number[root]);
  }
  patches.at_crowded_edge.assign(patches.count, false);
  for (const std::uint32_t f : crowded) patches.at_crowded_edge[patches.of_face[f]] = true;
  return patches;
}

std::vector<SeenShare> seen_from_outside(const TriangleMesh& mesh, const Patches& patches) {
  std::vector<std::vector<std::uint32_t>> faces(patches.count);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (face_area(mesh, f) > 0) faces[patches.of_face[f]].push_back(f);
  }
  const RayScene scene(mesh);
  const double off_mm = kOff * bounds(mesh).diagonal();
  std::vector<SeenShare> seen(patches.count);
  parallel_for(std::size_t{0}, patches.count, [&](std::size_t patch) {
    const auto& own = faces[patch];
    const std::size_t step = std::max<std::size_t>(1, own.size() / kFacesOfPatch);
    std::size_t looked = 0;
    for (std::size_t i = step / 2; i < own.size(); i += step, ++looked) {
      const Face& face = mesh.faces[own[i]];
      const Eigen::Vector3d middle =
          (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3;
      const Eigen::Vector3d normal = face_normal(mesh, own[i]);
      seen[patch].front += free_share(scene, middle, normal, off_mm);
      seen[patch].back += free_share(scene, middle, -normal, off_mm);
    }
    if (looked == 0) return;
    seen[patch].front /= static_cast<double>(looked);
    seen[patch].back /= static_cast<double>(looked);
  });
  return seen;
}

}  // namespace organbake
