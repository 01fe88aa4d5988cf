// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/organs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> camera_directions(int count) {
  std::vector<Vector3d> axes = {{0, -1, 0}, {1, 0, 0}, {0, 1, 0},
                                {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1).normalized());
  }
  if (count == 6) return axes;
  if (count == 8) return corners;
  axes.insert(axes.end(), corners.begin(), corners.end());
  return axes;
}

// The convex hull of few directions by brute force: a triangle is on it when all others lie below.
std::vector<std::array<std::uint32_t, 3>> hull(const std::vector<Vector3d>& d) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const auto n = static_cast<std::uint32_t>(d.size());
  // A cube's faces have four corners; a tiny fixed lift breaks the tie the same way every time.
  const auto at = [&](std::uint32_t i) -> Vector3d { return d[i] * (1 + 1e-7 * i * i); };
  for (std::uint32_t a = 0; a < n; ++a) {
    for (std::uint32_t b = a + 1; b < n; ++b) {
      for (std::uint32_t c = a + 1; c < n; ++c) {
        if (c == b) continue;
        const Vector3d normal = (at(b) - at(a)).cross(at(c) - at(a));
        bool outer = normal.dot(at(a)) > 0;
        for (std::uint32_t o = 0; o < n && outer; ++o) {
          if (o != a && o != b && o != c) outer = normal.dot(at(o) - at(a)) < 0;
        }
        if (outer) triangles.push_back({a, b, c});
      }
    }
  }
  return triangles;
}

Vector3d surface_normal(const SyntheticOrgan& organ, const Vector3d& point) {
  // Gradient of |p| − radius(p̂), by central differences.
  const auto f = [&](const Vector3d& p) {
    const Vector3d d = p - organ.center;
    return d.norm() - organ.radius(d.normalized());
  };
  Vector3d gradient;
  for (int k = 0; k < 3; ++k) {
    const Vector3d step = 1e-4 * Vector3d::Unit(k);
    gradient[k] = f(point + step) - f(point - step);
  }
  return gradient.normalized();
}

// Nothing at 80° from facing, all at 60°, smooth between.
double confidence_of(double cosine) {
  const double t = std::clamp((cosine - 0.174) / (0.5 - 0.174), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

CameraMaps make_maps(const SyntheticOptions& o, const PosedCamera& camera,
                     const ShellBinder& binder) {
  CameraMaps maps = background_maps(o.map_size, o.map_size);
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  const Vector3d eye = world_from_camera.translation;
  const auto ray_of = [&](double x, double y) -> Vector3d {
    return world_from_camera.rotation * unproject(camera.intrinsics, {x, y});
  };
  parallel_for(0, o.map_size, [&](int y) {
    for (int x = 0; x < o.map_size; ++x) {
      const std::size_t at = std::size_t(y) * o.map_size + x;
      const Vector3d ray = ray_of(x + 0.5, y + 0.5);
      const double depth = o.organ.trace(eye, ray);
      if (!std::isfinite(depth)) continue;
      const Vector3d point = eye + depth * ray;
      const ShellBinding bound = binder.bind(point);
      maps.depth_mm[at] = static_cast<float>(depth);
      maps.face[at] = bound.face;
      maps.height_mm[at] = static_cast<float>(bound.height_mm);
      const double cosine = -surface_normal(o.organ, point).dot(ray.normalized());
      maps.confidence[at] = static_cast<float>(confidence_of(cosine));
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int hits = 0;
      const int n = o.rays_per_texel_side;
      for (int s = 0; s < n * n; ++s) {
        const Vector3d sub = ray_of(x + (s % n + 0.5) / n, y + (s / n + 0.5) / n);
        const double t = o.organ.trace(eye, sub);
        if (!std::isfinite(t)) continue;
        sum += o.organ.color(eye + t * sub), ++hits;
      }
      maps.color[at] = hits > 0 ? Eigen::Vector3f(sum / hits) : o.organ.color(point);
    }
  });
  return maps;
}

// Height of the surface over a lattice node, by bisection along the shell's fibre.
double node_height(const SyntheticOrgan& organ, const ShellMatrix& m, double b1, double b2) {
  const auto outside = [&](double h) {
    const Vector3d d = shell_point(m, b1, b2, h) - organ.center;
    return d.norm() > organ.radius(d.normalized());
  };
  double low = -0.4 * organ.half_axes_mm.minCoeff(), high = -low;
  for (int i = 0; i < 50; ++i) (outside(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

std::uint32_t seen_by(const Bundle& bundle, const Vector3d& point) {
  std::uint32_t bits = 0;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const Vector3d p = camera.camera_from_world * point;
    const Eigen::Vector2d at = project(camera.intrinsics, p);
    const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
    if (x < 0 || y < 0 || x >= bundle.maps[c].width || y >= bundle.maps[c].height) continue;
    const std::size_t texel = std::size_t(y) * bundle.maps[c].width + x;
    const double texel_mm = p.z() / camera.intrinsics.fx;
    constexpr float kConfident = 0.5f;
    if (bundle.maps[c].confidence[texel] > kConfident &&
        std::abs(bundle.maps[c].depth_mm[texel] - p.z()) < 4 * texel_mm) {
      bits |= 1u << c;
    }
  }
  return bits;
}

BaseLayer make_base(const SyntheticOptions& o, const Bundle& bundle) {
  BaseLayer base;
  base.face_count = static_cast<std::uint32_t>(bundle.proxy.faces.size());
  double longest = 0;
  for (const auto& [a, b, c] : bundle.proxy.faces) {
    longest = std::max(longest, (bundle.proxy.vertices[a] - bundle.proxy.vertices[b]).norm());
  }
  base.steps = static_cast<std::uint32_t>(std::max(1.0, std::ceil(longest / o.base_step_mm)));
  const std::vector<Vector3d> normals = vertex_normals(bundle.proxy);
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix m = shell_matrix(bundle.proxy, normals, f);
    for (std::uint32_t i = 0; i <= base.steps; ++i) {
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const double b1 = double(i) / base.steps, b2 = double(j) / base.steps;
        const double h = node_height(o.organ, m, b1, b2);
        const Vector3d point = shell_point(m, b1, b2, h);
        base.height_mm.push_back(static_cast<float>(h));
        base.color.push_back(o.organ.color(point));
        base.seen_by.push_back(seen_by(bundle, point));
      }
    }
  }
  return base;
}

MechanicsModel make_mechanics(const TriangleMesh& proxy, const Vector3d& center) {
  MechanicsModel model;
  model.mass_kg.assign(proxy.vertices.size(), 0.3 / static_cast<double>(proxy.vertices.size()));
  MeshEdges(proxy).for_each([&](std::span<const EdgeUse> uses) {
    const auto [low, high] = std::pair(uses[0].low, uses[0].high);
    const double length = (proxy.vertices[low] - proxy.vertices[high]).norm();
    model.springs.push_back({low, high, length, 0.5, 0.005});
  });
  double back = -1e300;
  for (const auto& v : proxy.vertices) back = std::max(back, v.y());
  for (std::uint32_t v = 0; v < proxy.vertices.size(); ++v) {
    if (proxy.vertices[v].y() > center.y() + 0.7 * (back - center.y())) model.anchors.push_back(v);
  }
  model.young_modulus_kpa = 5;
  model.density_kg_per_m3 = 1050;
  model.thickness_mm = 10;
  model.instrument_radius_mm = 5;
  return model;
}

}  // namespace

double SyntheticOrgan::radius(const Vector3d& direction) const {
  Vector3d d = direction;
  if (mirrored) d.x() = -d.x();
  const double ellipsoid = 1 / d.cwiseQuotient(half_axes_mm).norm();
  if (lump_share == 0) return ellipsoid;
  const double f = lump_frequency;
  const double lumps = std::sin(f * d.x() + 1) * std::sin(f * d.y() + 2 * d.z()) +
                       0.5 * std::sin(2.1 * f * d.z() + 0.5) * std::cos(1.7 * f * d.x() - d.y());
  return ellipsoid * (1 + lump_share * lumps);
}

Eigen::Vector3f SyntheticOrgan::color(const Vector3d& point) const {
  Vector3d p = point - center;
  if (mirrored) p.x() = -p.x();
  const double w = 2 * std::numbers::pi / texture_mm;
  const double fine = std::sin(w * p.x() + std::sin(0.3 * w * p.z())) * std::sin(w * p.z() + 0.7) *
                      std::cos(0.8 * w * p.y());
  const double broad =
      std::sin(0.11 * w * (p.x() + 2 * p.y())) + std::cos(0.13 * w * (p.z() - p.y()));
  const double base = 0.42 + 0.12 * fine + 0.07 * broad;
  return Eigen::Vector3d(base * 1.25, base * 0.55 + 0.06 * fine, base * 0.45 - 0.03 * broad)
      .cast<float>();
}

double SyntheticOrgan::trace(const Vector3d& origin, const Vector3d& ray) const {
  const auto outside = [&](double t) {
    const Vector3d d = origin + t * ray - center;
    return d.norm() - radius(d.normalized());
  };
  const double length = ray.norm(), most = half_axes_mm.maxCoeff() * (1 + 1.5 * lump_share);
  const Vector3d to_center = center - origin;
  const double middle = to_center.dot(ray) / ray.squaredNorm();
  const double miss2 = (origin + middle * ray - center).squaredNorm();
  if (miss2 >= most * most) return std::numeric_limits<double>::infinity();
  const double half = std::sqrt(most * most - miss2) / length;
  // Steps short enough not to jump a lump, then bisection.
  const int steps = lump_share == 0 ? 24 : 96;
  double before = middle - half;
  for (int i = 1; i <= steps; ++i) {
    double after = middle - half + 2 * half * i / steps;
    if (outside(after) < 0) {
      for (int k = 0; k < 45; ++k) {
        const double mid = 0.5 * (before + after);
        (outside(mid) < 0 ? after : before) = mid;
      }
      return 0.5 * (before + after);
    }
    before = after;
  }
  return std::numeric_limits<double>::infinity();
}

TriangleMesh SyntheticOrgan::mesh(int subdivisions) const {
  TriangleMesh mesh = sphere_mesh(1, subdivisions);
  if (mirrored) mesh = organbake::mirrored(std::move(mesh));
  for (auto& v : mesh.vertices) {
    v = center + radius(v) * v;
    mesh.colors.push_back(color(v));
  }
  return mesh;
}

CameraSet make_cameras(const SyntheticOptions& o) {
  CameraSet set;
  const double reach = 1.2 * o.organ.half_axes_mm.maxCoeff(), distance = 4 * reach;
  const double focal = 0.47 * o.map_size * std::sqrt(distance * distance - reach * reach) / reach;
  set.manifold.center_world_mm = o.organ.center;
  for (const Vector3d& d : camera_directions(o.camera_count)) {
    PosedCamera camera;
    camera.name = "virtual_" + std::to_string(set.cameras.size());
    camera.intrinsics = {.width = o.map_size,
                         .height = o.map_size,
                         .fx = focal,
                         .fy = focal,
                         .cx = 0.5 * o.map_size,
                         .cy = 0.5 * o.map_size};
    camera.camera_from_world =
        look_at(o.organ.center + distance * d, o.organ.center, Vector3d::UnitZ());
    set.cameras.push_back(camera);
    set.manifold.directions.push_back(d);
  }
  set.manifold.triangles = hull(set.manifold.directions);
  return set;
}

Bundle make_synthetic_bundle(const SyntheticOptions& o) {
  Bundle bundle;
  bundle.manifest.name = "synthetic";
  bundle.proxy = o.organ.mesh(o.proxy_subdivisions);
  bundle.proxy.colors.clear();
  bundle.cameras = make_cameras(o);
  bundle.mechanics = make_mechanics(bundle.proxy, o.organ.center);
  const ShellBinder binder(bundle.proxy, 0.5 * o.organ.half_axes_mm.minCoeff());
  for (const PosedCamera& camera : bundle.cameras.cameras) {
    bundle.maps.push_back(make_maps(o, camera, binder));
  }
  bundle.base = make_base(o, bundle);
  return bundle;
}

const SyntheticOptions& organ_options() {
  static const SyntheticOptions options = [] {
    SyntheticOptions o;
    o.organ.lump_share = 0.05;
    return o;
  }();
  return options;
}

const Bundle& organ_to_play() {
  static const Bundle bundle = make_synthetic_bundle(organ_options());
  return bundle;
}

std::vector<Vector3d> dented(const TriangleMesh& proxy, const Vector3d& direction,
                             double depth_mm) {
  const Bounds box = bounds(proxy);
  std::size_t top = 0;
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
    if (direction.dot(proxy.vertices[v] - proxy.vertices[top]) > 0) top = v;
  }
  std::vector<Vector3d> moved = proxy.vertices;
  const double reach = 0.3 * box.diagonal();
  for (Vector3d& v : moved) {
    const double d = std::min(1.0, (v - proxy.vertices[top]).norm() / reach);
    v -= depth_mm * std::pow(1 - d * d, 3) * direction.normalized();
  }
  return moved;
}

}  // namespace organbake
