// SPDX-License-Identifier: GPL-3.0-or-later
#include "traced_organ.h"
#include "support/testing.h"

namespace organbake {
namespace {

const SyntheticOptions& options() {
  static const SyntheticOptions options = [] {
    SyntheticOptions o;
    o.organ.lump_share = 0.05;
    o.camera_count = 14;
    o.map_size = 448;
    o.proxy_subdivisions = 2;
    o.base_step_mm = 1.5;
    return o;
  }();
  return options;
}

bool is_outline(const Traced& t, int x, int y) {
  constexpr int kReach_px = 2;
  constexpr float kSteepest = 6;  // pixels of depth from one pixel to the next: 80°
  const auto depth = [&](int u, int v) { return t.depth_mm[std::size_t(v) * t.width + u]; };
  for (int v = y - kReach_px; v <= y + kReach_px; ++v) {
    for (int u = x - kReach_px; u <= x + kReach_px; ++u) {
      if (u < 1 || v < 1 || u >= t.width || v >= t.height) return true;
      const float here = depth(u, v);
      if (!std::isfinite(here)) return true;
      const float pixel_mm = here / static_cast<float>(t.width);  // about: the lens is that narrow
      if (!(std::abs(here - depth(u - 1, v)) < kSteepest * pixel_mm &&
            std::abs(here - depth(u, v - 1)) < kSteepest * pixel_mm))
        return true;
    }
  }
  return false;
}

TriangleMesh mesh_at(const std::vector<Eigen::Vector3d>& carried) {
  TriangleMesh mesh;
  mesh.vertices = carried;
  mesh.faces = traced_surface().at_rest().faces;
  return mesh;
}

}  // namespace

const Bundle& traced_organ() {
  static const Bundle bundle = make_synthetic_bundle(options());
  return bundle;
}

const CarriedSurface& traced_surface() {
  static const CarriedSurface surface(options().organ.mesh(6), traced_organ().shell());
  return surface;
}

Traced traced(const std::vector<Eigen::Vector3d>& carried, const View& view) {
  Traced t;
  t.width = view.camera.intrinsics.width, t.height = view.camera.intrinsics.height;
  const TriangleMesh mesh = mesh_at(carried);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
  const RigidTransform world_from_camera = view.camera.camera_from_world.inverse();
  std::vector<Ray> rays;
  for (int y = 0; y < t.height; ++y)
    for (int x = 0; x < t.width; ++x)
      rays.push_back(
          {world_from_camera.translation,
           world_from_camera.rotation * unproject(view.camera.intrinsics, {x + 0.5, y + 0.5})});
  std::vector<RayHit> hits(rays.size());
  RayScene(mesh).first_hits(rays, hits);
  t.seen.resize(hits.size());
  t.depth_mm.assign(hits.size(), Traced::kNothing);
  t.normal.assign(hits.size(), Eigen::Vector3d::Zero());
  t.outline.assign(hits.size(), false);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].face == kNoHit) continue;
    t.seen[i] = {hits[i].face, hits[i].u, hits[i].v};
    t.depth_mm[i] = static_cast<float>(hits[i].t);
    t.normal[i] =
        (view.camera.camera_from_world.rotation * traced_surface().point(t.seen[i], normals))
            .normalized();
  }
  for (int y = 0; y < t.height; ++y)
    for (int x = 0; x < t.width; ++x) t.outline[std::size_t(y) * t.width + x] = is_outline(t, x, y);
  return t;
}

Sight::Sight(const std::vector<Eigen::Vector3d>& carried, const View& view)
    : view_(view), scene_(mesh_at(carried)) {}

bool Sight::sees(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = view_.camera.camera_from_world * point;
  if (!(p.z() > view_.near_mm)) return false;
  const Eigen::Vector2d px = project(view_.camera.intrinsics, p);
  const Intrinsics& k = view_.camera.intrinsics;
  if (!(px.x() >= 0 && px.y() >= 0 && px.x() < k.width && px.y() < k.height)) return false;
  const Eigen::Vector3d eye = view_.camera.center_world_mm();
  const Ray ray{eye, point - eye};
  RayHit hit;
  scene_.first_hits({&ray, 1}, {&hit, 1});
  constexpr double kItself_mm = 0.05;
  return hit.face == kNoHit || (1 - hit.t) * ray.direction.norm() < kItself_mm;
}

void poke(Player& player, double depth_mm) {
  const Bundle& bundle = player.bundle();
  const Eigen::Vector3d out = bundle.cameras.manifold.directions.front();
  const double radius = 8;
  const Eigen::Vector3d skin =
      bundle.cameras.manifold.center_world_mm + options().organ.radius(out) * out;
  for (int i = 1; i <= 30; ++i) {
    const double depth = depth_mm * std::min(1.0, i / 20.0);
    player.step({{skin + (radius - depth) * out, radius, Ball{}, true}});
  }
}

Rgb8Image draw_with_truth(Player& player, const View& view, const std::vector<Solid>& solids,
                          TruthTracker& tracker) {
  DrawOptions draw;
  draw.keep_bound = true;
  draw.solids = solids;
  Frame frame;
  player.draw(view, draw, frame);
  tracker.advance(player, view, solids, frame);
  return frame.color;
}

double intersection_over_union(const std::vector<bool>& a, const std::vector<bool>& b) {
  std::size_t both = 0, any = 0;
  for (std::size_t i = 0; i < a.size(); ++i) both += a[i] && b[i], any += a[i] || b[i];
  return any == 0 ? 1 : double(both) / double(any);
}

}  // namespace organbake
