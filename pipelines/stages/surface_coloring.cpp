// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/surface_coloring.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace organbake {
namespace {

// A hit on any face round each vertex, at that corner: what shade() asks for.
std::vector<RayHit> hits_at_vertices(const TriangleMesh& surface) {
  std::vector<RayHit> hits(surface.vertices.size());
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      RayHit& hit = hits[surface.faces[f][corner]];
      if (hit.face != kNoHit) continue;
      hit.face = static_cast<std::uint32_t>(f);
      hit.t = 0;
      hit.u = corner == 1 ? 1.0f : 0.0f;
      hit.v = corner == 2 ? 1.0f : 0.0f;
    }
  }
  return hits;
}

template <class T>
std::vector<T> part(const std::vector<T>& all, const std::vector<std::size_t>& chosen) {
  std::vector<T> values;
  values.reserve(chosen.size());
  for (std::size_t i : chosen) values.push_back(all[i]);
  return values;
}

}  // namespace

std::unique_ptr<SurfaceColor> choose_color(const TriangleMesh& surface, const RayScene& scene,
                                           std::vector<Photo> photos, const Material& material,
                                           StageReport& report) {
  report.add("photos", photos.size());
  if (!photos.empty()) {
    report.add("color", "photos");
    report.skipped.push_back({"the material", "there are photographs"});
    return make_photo_color(surface, scene, std::move(photos));
  }
  report.skipped.push_back({"colour from photographs", "none are given"});
  if (!surface.colors.empty()) {
    report.add("color", "vertices");
    report.skipped.push_back({"the material", "the surface has colours of its own"});
    return make_vertex_color(surface);
  }
  report.add("color", "material");
  report.skipped.push_back({"colour from vertices", "the surface has none"});
  return make_material_color(material);
}

void color_vertices(TriangleMesh& surface, const SurfaceColor& color) {
  const std::vector<RayHit> hits = hits_at_vertices(surface);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(surface);
  std::vector<Eigen::Vector3f> colors(surface.vertices.size(), Eigen::Vector3f::Zero());
  constexpr std::size_t kPiece = 2048;  // enough work for a thread, few enough to stay in cache
  const tbb::blocked_range<std::size_t> all(0, surface.vertices.size(), kPiece);
  tbb::parallel_for(all, [&](const tbb::blocked_range<std::size_t>& range) {
    std::vector<std::size_t> used;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      if (hits[i].face != kNoHit) used.push_back(i);
    }
    std::vector<Eigen::Vector3f> shaded(used.size());
    color.shade(part(surface.vertices, used), part(normals, used), part(hits, used), shaded);
    for (std::size_t i = 0; i < used.size(); ++i) colors[used[i]] = shaded[i];
  });
  surface.colors = std::move(colors);
}

}  // namespace organbake
