// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"
#include "support/testing.h"

namespace organbake {

// The phantom organ from all round, as depth maps with noise and cameras that are off.
struct OrganViews {
  TriangleMesh truth;
  std::vector<DepthView> views;
};

struct ViewFaults {
  double noise = 0;                    // of the depth, standard deviation, every pixel for itself
  double place_mm = 0, angle_rad = 0;  // of each camera, in a direction of its own
};

inline Plane depth_seen(const RayScene& scene, const PosedCamera& camera) {
  const Intrinsics& k = camera.intrinsics;
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  Plane depth(k.width, k.height, std::numeric_limits<float>::infinity());
  parallel_for(0, k.height, [&](int y) {
    std::vector<Ray> rays(k.width);
    std::vector<RayHit> hits(k.width);
    for (int x = 0; x < k.width; ++x) {
      rays[x].origin = world_from_camera.translation;
      rays[x].direction = world_from_camera.rotation * unproject(k, {x + 0.5, y + 0.5});
    }
    scene.first_hits(rays, hits);
    for (int x = 0; x < k.width; ++x)
      if (hits[x].face != kNoHit) depth.at(x, y) = static_cast<float>(hits[x].t);
  });
  return depth;
}

inline Eigen::Vector3d random_way(RandomStream& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

// Without faults; drawn once in a program.
inline const OrganViews& exact_views(int count, int size) {
  static std::map<std::pair<int, int>, OrganViews> drawn;
  OrganViews& result = drawn[{count, size}];
  if (!result.views.empty()) return result;
  OrganPhantomOptions options;
  options.photo_count = count;
  options.photo_size = size;
  const OrganPhantom phantom(options);
  static const TriangleMesh truth = phantom.surface(6);
  result.truth = truth;
  const RayScene scene(truth);
  for (const PosedCamera& camera : phantom.photo_cameras())
    result.views.push_back({"view " + std::to_string(result.views.size()),
                            camera,
                            depth_seen(scene, camera),
                            {},
                            phantom.photograph(camera),
                            camera.intrinsics});
  return result;
}

inline OrganViews organ_views(int count, int size, const ViewFaults& faults,
                              std::uint64_t seed = 1) {
  OrganViews result = exact_views(count, size);
  std::size_t i = 0;
  for (DepthView& view : result.views) {
    RandomStream random(seed, i++);
    for (float& z : view.depth_mm.values)
      if (std::isfinite(z)) z *= static_cast<float>(1 + faults.noise * random.normal());
    // Turned about its own place, and shifted.
    RigidTransform& pose = view.camera.camera_from_world;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(faults.angle_rad, random_way(random)).toRotationMatrix();
    pose = RigidTransform{turn, faults.place_mm * random_way(random)} * pose;
  }
  return result;
}

struct SurfaceErrors {
  double rms_mm = 0;      // of the mesh's vertices from the truth
  double missing_mm = 0;  // of the truth's vertices from the mesh, root mean square
  double color_db = 0;    // sRGB, against the truth's colour at the nearest place
};

inline Eigen::Vector3f color_near(const TriangleMesh& mesh, const ClosestPoint& at) {
  const Face& face = mesh.faces[at.face];
  // The nearest corner: the truth is finer than the colours.
  std::uint32_t nearest = face[0];
  for (const std::uint32_t corner : face)
    if ((mesh.vertices[corner] - at.point).norm() < (mesh.vertices[nearest] - at.point).norm())
      nearest = corner;
  return mesh.colors[nearest];
}

inline SurfaceErrors errors_of(const TriangleMesh& mesh, const TriangleMesh& truth) {
  const RayScene truth_scene(truth), mesh_scene(mesh);
  SurfaceErrors errors;
  double squares = 0, color_squares = 0, back = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const ClosestPoint at = truth_scene.closest_point(mesh.vertices[v]);
    squares += at.distance_mm * at.distance_mm;
    if (mesh.colors.empty()) continue;
    const Eigen::Vector3f expected = color_near(truth, at);
    for (int c = 0; c < 3; ++c) {
      const double off = srgb_from_linear(mesh.colors[v][c]) - srgb_from_linear(expected[c]);
      color_squares += off * off / 3;
    }
  }
  for (const Eigen::Vector3d& vertex : truth.vertices) {
    const double far = mesh_scene.closest_point(vertex).distance_mm;
    back += far * far;
  }
  const auto count = static_cast<double>(mesh.vertices.size());
  errors.rms_mm = std::sqrt(squares / count);
  errors.missing_mm = std::sqrt(back / static_cast<double>(truth.vertices.size()));
  errors.color_db = -10 * std::log10(color_squares / count);
  return errors;
}

}  // namespace organbake
