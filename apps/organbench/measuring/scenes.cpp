// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs whose truth is known: surfaces with cameras, poses, pairs of eyes, bundles in memory.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "measuring/scenes.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"
#include "organbake/image/srgb.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/registration/registered_surface.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

using Eigen::Vector3d;

Vector3d random_direction(RandomStream& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

RigidTransform start_from(const RegisteredSurface& surface, const RigidTransform& truth,
                          double shift_mm, double turn_deg, std::uint64_t seed) {
  RandomStream random(seed, 77);
  Motion motion;
  motion << turn_deg * std::numbers::pi / 180 * random_direction(random),
      shift_mm * random_direction(random);
  return rigid_transform(moved(object_pose(truth, surface.center()), motion), surface.center());
}

EyePair::EyePair(int width, int height, std::uint64_t seed)
    : EyePair(LaparoscopyPhantom({.seed = seed,
                                  .width = width,
                                  .height = height,
                                  .frames = 1,
                                  .texture = 0.3,
                                  // Tilted so, tissue is 40…100 mm away.
                                  .tilt_rad = std::numbers::pi / 6,
                                  .baseline_mm = 4.5})) {}

EyePair::EyePair(const LaparoscopyPhantom& phantom)
    : left(phantom.frame(0)),
      right(phantom.right_frame(0)),
      rectifier({phantom.camera(0).intrinsics, phantom.right_camera(0).intrinsics,
                 phantom.right_camera(0).camera_from_world *
                     phantom.camera(0).camera_from_world.inverse()}) {}

StereoDepth EyePair::matched(Mask* tissue) const {
  const PreparedEyes ready = prepare_eyes(left.image, right.image, rectifier, {});
  if (tissue) *tissue = ready.left.tissue;
  return stereo_depth(ready.left, ready.right, rectifier.eyes(), {});
}

Bundle memory_bundle(const TriangleMesh& surface, const TriangleMesh& proxy,
                     const PlacementOptions& placement, const CaptureOptions& capturing,
                     double skin_edge_mm) {
  const Placement placed = place_cameras(surface, placement);
  Bundle bundle;
  bundle.proxy = proxy;
  if (skin_edge_mm > 0) bundle.skin = bake_smooth_skin(surface, proxy, skin_edge_mm);
  CaptureResult captured = capture(surface, bundle.shell().at_rest(), placed.cameras,
                                   *make_vertex_color(surface), capturing);
  bundle.cameras = {placed.cameras, {}, placed.manifold};
  bundle.mechanics = make_mechanics(proxy, {});
  bundle.maps = std::move(captured.maps);
  bundle.base = std::move(captured.base);
  return bundle;
}

namespace {

// Where the surface lies in directions from its middle.
class Outside {
 public:
  struct ColoredPoint {
    Eigen::Vector3d point_mm;
    Eigen::Vector3f color;  // linear
  };

  explicit Outside(const TriangleMesh& surface)
      : surface_(surface),
        scene_(surface),
        middle_(bounds(surface).center()),
        beyond_mm_(bounds(surface).diagonal()) {}

  std::vector<ColoredPoint> look(const std::vector<Eigen::Vector3d>& directions) const {
    std::vector<Ray> rays;
    rays.reserve(directions.size());
    for (const Eigen::Vector3d& d : directions)
      rays.push_back({.origin = middle_ + beyond_mm_ * d, .direction = -d});
    std::vector<RayHit> hits(rays.size());
    scene_.first_hits(rays, hits);
    std::vector<ColoredPoint> points;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].face == kNoHit) throw BadDataError("the surface has no skin in a direction");
      points.push_back({rays[i].origin + hits[i].t * rays[i].direction, color_at(hits[i])});
    }
    return points;
  }

 private:
  Eigen::Vector3f color_at(const RayHit& hit) const {
    const auto [a, b, c] = surface_.faces[hit.face];
    return (1 - hit.u - hit.v) * surface_.colors.at(a) + hit.u * surface_.colors.at(b) +
           hit.v * surface_.colors.at(c);
  }

  const TriangleMesh& surface_;
  RayScene scene_;
  Eigen::Vector3d middle_;
  double beyond_mm_;
};

Eigen::Vector2f texel_of(const Eigen::Vector3d& direction) {
  return {
      static_cast<float>(0.5 + std::atan2(direction.y(), direction.x()) / (2 * std::numbers::pi)),
      static_cast<float>(std::acos(std::clamp(direction.z(), -1.0, 1.0)) / std::numbers::pi)};
}

Eigen::Vector3d direction_of(double u, double v) {
  const double longitude = (u - 0.5) * 2 * std::numbers::pi, from_pole = v * std::numbers::pi;
  return {std::cos(longitude) * std::sin(from_pole), std::sin(longitude) * std::sin(from_pole),
          std::cos(from_pole)};
}

Rgb8Image skin_of(const Outside& outside, int side_px) {
  Rgb8Image skin(side_px, side_px);
  parallel_for(0, side_px, [&](int y) {
    std::vector<Eigen::Vector3d> row;
    row.reserve(side_px);
    for (int x = 0; x < side_px; ++x)
      row.push_back(direction_of((x + 0.5) / side_px, (y + 0.5) / side_px));
    const auto points = outside.look(row);
    for (int x = 0; x < side_px; ++x)
      for (int c = 0; c < 3; ++c) skin.at(x, y)[c] = srgb8_from_linear(points[x].color[c]);
  });
  return skin;
}

// Faces across the skin's left border get corners of their own, beyond its right one.
void close_seam(SkinnedMesh& skinned) {
  std::map<std::uint32_t, std::uint32_t> beyond;
  const auto moved = [&](std::uint32_t v) {
    const auto [at, added] =
        beyond.try_emplace(v, static_cast<std::uint32_t>(skinned.mesh.vertices.size()));
    if (added) {
      skinned.mesh.vertices.push_back(skinned.mesh.vertices[v]);
      skinned.mesh.colors.push_back(skinned.mesh.colors[v]);
      skinned.texels.emplace_back(skinned.texels[v] + Eigen::Vector2f(1, 0));
    }
    return at->second;
  };
  for (Face& face : skinned.mesh.faces) {
    const auto right_of_middle = [&](std::uint32_t v) { return skinned.texels[v].x() > 0.75F; };
    if (std::none_of(face.begin(), face.end(), right_of_middle)) continue;
    for (std::uint32_t& v : face)
      if (skinned.texels[v].x() < 0.25F) v = moved(v);
  }
}

}  // namespace

SkinnedMesh skinned_mesh(const TriangleMesh& surface, int subdivisions, int skin_px) {
  const Outside outside(surface);
  SkinnedMesh skinned{make_icosphere(subdivisions), {}, skin_of(outside, skin_px)};
  for (const Eigen::Vector3d& direction : skinned.mesh.vertices)
    skinned.texels.push_back(texel_of(direction));
  const auto points = outside.look(skinned.mesh.vertices);
  for (std::size_t v = 0; v < points.size(); ++v) {
    skinned.mesh.vertices[v] = points[v].point_mm;
    skinned.mesh.colors.push_back(points[v].color);
  }
  close_seam(skinned);
  return skinned;
}

}  // namespace organbake
