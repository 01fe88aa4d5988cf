// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/skinned_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"
#include "organbake/image/srgb.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
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
