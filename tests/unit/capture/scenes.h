// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/capture/capture.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/image/srgb.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {

// A camera whose every number differs from its neighbour's, so that a swap shows.
inline PosedCamera odd_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  PosedCamera camera;
  camera.name = "odd";
  camera.intrinsics = {150, 90, 160, 171, 71, 48};
  camera.camera_from_world = look_at(eye, target, Eigen::Vector3d(0.2, -0.3, 1));
  return camera;
}

// A square one with a centred axis, `size` pixels across about 40°.
inline PosedCamera plain_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                                int size) {
  PosedCamera camera;
  camera.name = "plain";
  camera.intrinsics = {size, size, 1.37 * size, 1.37 * size, 0.5 * size, 0.5 * size};
  camera.camera_from_world = look_at(eye, target, Eigen::Vector3d::UnitZ());
  return camera;
}

// A square of side 2·half in the plane through `center`, facing `normal`, in cells² · 2 triangles.
inline TriangleMesh square_at(const Eigen::Vector3d& center, const Eigen::Vector3d& normal,
                              double half, int cells) {
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      mesh.vertices.push_back(center +
                              half * ((2.0 * i / cells - 1) * u + (2.0 * j / cells - 1) * v));
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (cells + 1) + i), b = a + 1;
      const std::uint32_t c = a + cells + 1, d = c + 1;
      mesh.faces.push_back({a, b, d});
      mesh.faces.push_back({a, d, c});
    }
  return mesh;
}

inline TriangleMesh painted(TriangleMesh mesh, const Eigen::Vector3f& color) {
  mesh.colors.assign(mesh.vertices.size(), color);
  return mesh;
}

// Colours of surface points found by shooting through a camera's pixels.
struct SurfaceSample {
  Eigen::Vector3d point;
  Eigen::Vector3f color;
};
inline std::vector<SurfaceSample> shade_through(const TriangleMesh& mesh, const SurfaceColor& color,
                                                const PosedCamera& camera) {
  const RayScene scene(mesh);
  const SmoothNormals normals(mesh);
  const CameraRays camera_rays(camera);
  std::vector<Ray> rays;
  for (int y = 0; y < camera.intrinsics.height; ++y)
    for (int x = 0; x < camera.intrinsics.width; ++x)
      rays.push_back(camera_rays.through(x + 0.5, y + 0.5));
  std::vector<RayHit> all(rays.size()), hits;
  scene.first_hits(rays, all);
  std::vector<Eigen::Vector3d> points, at_points;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    if (all[r].face == kNoHit) continue;
    hits.push_back(all[r]);
    points.push_back(rays[r].origin + all[r].t * rays[r].direction);
    at_points.push_back(normals.at(all[r]));
  }
  std::vector<Eigen::Vector3f> colors;
  color.shade(points, at_points, hits, colors);
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < points.size(); ++i) samples.push_back({points[i], colors[i]});
  return samples;
}

// A photograph of a mesh by its vertex colours (red, green … kept as they are: no light).
inline Photo photo_of(const TriangleMesh& mesh, const PosedCamera& camera) {
  Photo photo{camera, Rgb8Image(camera.intrinsics.width, camera.intrinsics.height)};
  const auto color = make_vertex_color(mesh);
  for (const SurfaceSample& sample : shade_through(mesh, *color, camera)) {
    const Eigen::Vector2d pixel = project(camera, sample.point);
    for (int c = 0; c < 3; ++c)
      photo.image.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))[c] =
          srgb8_from_linear(sample.color[c]);
  }
  return photo;
}

}  // namespace organbake
