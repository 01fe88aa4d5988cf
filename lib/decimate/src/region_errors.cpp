// SPDX-License-Identifier: GPL-3.0-or-later
// How far a proxy lies off, as a share of the thickness there: a millimetre is little on a liver
// and all of a vessel.
#include "region_errors.h"

#include <algorithm>

#include "organbake/core/parallel.h"
#include "organbake/decimate/mesh_distance.h"

namespace organbake {
namespace {

// Barycentric, over the whole face with its corners.
const std::vector<Eigen::Vector3d>& lattice_weights() {
  static const std::vector<Eigen::Vector3d> weights = [] {
    constexpr int kSteps = 6;
    std::vector<Eigen::Vector3d> all;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; i + j <= kSteps; ++j)
        all.push_back(Eigen::Vector3d(i, j, kSteps - i - j) / kSteps);
    return all;
  }();
  return weights;
}

}  // namespace

RegionErrors RegionMeter::measure(const TriangleMesh& proxy, const RunContext& context) const {
  const bool known = !regions_.thickness_mm.empty();
  const std::size_t count = std::max<std::size_t>(1, regions_.thickness_mm.size());
  // A face of the proxy counts for the region that its middle lies nearest to.
  std::vector<std::uint32_t> of_proxy(proxy.faces.size(), 0), of_surface = regions_.of_face;
  if (!known) of_surface.assign(surface_.faces.size(), 0);
  if (known)
    parallel_for(std::size_t{0}, proxy.faces.size(), [&](std::size_t f) {
      const Face& face = proxy.faces[f];
      const Eigen::Vector3d middle =
          (proxy.vertices[face[0]] + proxy.vertices[face[1]] + proxy.vertices[face[2]]) / 3;
      of_proxy[f] = of_surface[scene_.closest_point(middle).face];
    });
  const auto there =
      largest_distances(surface_, {of_surface, count}, proxy, RayScene(proxy), context);
  const auto back = largest_distances(proxy, {of_proxy, count}, surface_, scene_, context);
  RegionErrors errors;
  errors.max_mm = *std::max_element(there.begin(), there.end());
  errors.reverse_max_mm = *std::max_element(back.begin(), back.end());
  for (std::size_t r = 0; known && r < count; ++r) {
    const double mm = std::max(there[r], back[r]), thickness_mm = regions_.thickness_mm[r];
    if (mm <= errors.worst_share * thickness_mm) continue;
    errors.worst_share = mm / thickness_mm;
    errors.worst_mm = mm;
    errors.worst_thickness_mm = thickness_mm;
  }
  return errors;
}

std::vector<FarPoint> RegionMeter::far_points(const TriangleMesh& proxy,
                                              const RunContext& context) const {
  std::vector<FarPoint> far(proxy.faces.size());
  if (regions_.thickness_mm.empty()) return far;
  parallel_for(std::size_t{0}, proxy.faces.size(), [&](std::size_t f) {
    context.throw_if_cancelled();
    const Face& c = proxy.faces[f];
    for (const Eigen::Vector3d& w : lattice_weights()) {
      const Eigen::Vector3d at =
          w[0] * proxy.vertices[c[0]] + w[1] * proxy.vertices[c[1]] + w[2] * proxy.vertices[c[2]];
      const ClosestPoint near = scene_.closest_point(at);
      const double share = share_at(near.face, near.distance_mm);
      if (share > far[f].share) far[f] = {share, near.point, at};
    }
  });
  std::vector<std::uint32_t> face_of(surface_.vertices.size(), kNoHit);
  for (std::uint32_t f = 0; f < surface_.faces.size(); ++f)
    for (const std::uint32_t v : surface_.faces[f]) face_of[v] = f;
  const RayScene scene(proxy);
  std::vector<ClosestPoint> near(surface_.vertices.size());
  parallel_for(std::size_t{0}, near.size(), [&](std::size_t v) {
    if (face_of[v] != kNoHit) near[v] = scene.closest_point(surface_.vertices[v]);
  });
  for (std::size_t v = 0; v < near.size(); ++v) {
    if (face_of[v] == kNoHit) continue;
    const double share = share_at(face_of[v], near[v].distance_mm);
    FarPoint& known = far[near[v].face];
    if (share > known.share) known = {share, surface_.vertices[v], near[v].point};
  }
  return far;
}

}  // namespace organbake
