// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a body by their thickness, and how far a proxy is off there: a millimetre is little on a
// liver and all of a vessel.
//
// Thickness is measured by chords through the body, whose mean ties volume to area (Cauchy's
// formula; Santaló 1976); a connected set of faces with short chords, longer than wide, is a part
// of its own.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "organbake/core/parallel.h"
#include "organbake/core/union_find.h"
#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/raycast/ray_scene.h"
#include "proxies.h"

namespace organbake {
namespace {

constexpr std::size_t kFaces = 8'000;  // of the thinned surface that is looked at
constexpr std::size_t kRays = 24;      // from the middle of each
constexpr double kThin = 0.5;          // of the region's thickness: what is thinner is another
constexpr double kReach = 0.5;         // of the piece's thickness: chords are averaged within
// In squares of its thickness, the area of the smallest region: a tube as long as 1.3 radii.
constexpr double kSmallestArea = 8;

// Of the whole area: smaller pieces are specks, whose thickness asks nothing.
constexpr double kSpeck = 1e-3;

using Faces = std::vector<std::uint32_t>;

Eigen::Vector3d middle(const TriangleMesh& mesh, std::size_t face) {
  const Face& f = mesh.faces[face];
  return (mesh.vertices[f[0]] + mesh.vertices[f[1]] + mesh.vertices[f[2]]) / 3;
}

// Directions about −normal with the density of the cosine: a spiral over the disc below the
// half-ball, turned from face to face.
std::array<Ray, kRays> rays_inward(const Eigen::Vector3d& from, const Eigen::Vector3d& normal,
                                   std::size_t face, double least_mm) {
  constexpr double kGoldenAngle = std::numbers::pi * (3 - 2.23606797749979);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::array<Ray, kRays> rays;
  for (std::size_t k = 0; k < kRays; ++k) {
    const double share = (double(k) + 0.5) / double(kRays), angle = kGoldenAngle * double(k + face);
    rays[k].origin = from;
    rays[k].direction = std::sqrt(share) * (std::cos(angle) * u + std::sin(angle) * v) -
                        std::sqrt(1 - share) * normal;
    rays[k].t_min = least_mm;
  }
  return rays;
}

// Half the mean chord from the middle of each face.
std::vector<double> half_chords_mm(const TriangleMesh& mesh, const RunContext& context) {
  const RayScene scene(mesh);
  const double outward = signed_volume(mesh) < 0 ? -1 : 1;
  const double least_mm = 1e-5 * bounds(mesh).diagonal();  // above the scene's margin
  std::vector<double> chords_mm(mesh.faces.size(), 0);
  parallel_for(std::size_t{0}, chords_mm.size(), [&](std::size_t f) {
    context.throw_if_cancelled();
    const Eigen::Vector3d normal = outward * face_normal(mesh, f);
    if (normal.isZero()) return;
    const auto rays = rays_inward(middle(mesh, f), normal, f, least_mm);
    std::array<RayHit, kRays> hits;
    scene.first_hits(rays, hits);
    double sum_mm = 0;
    std::size_t count = 0;
    for (const RayHit& hit : hits) {
      if (hit.face == kNoHit) continue;
      sum_mm += hit.t;
      ++count;
    }
    if (count > 0) chords_mm[f] = 0.5 * sum_mm / double(count);
  });
  return chords_mm;
}

// The regions of a thinned surface, found from its pieces downward.
class RegionSearch {
 public:
  RegionSearch(const TriangleMesh& mesh, const RunContext& context)
      : mesh_(mesh), twins_(half_edge_twins(mesh)), chord_mm_(half_chords_mm(mesh, context)) {
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) area_mm2_.push_back(face_area(mesh, f));
    regions_.of_face.assign(mesh.faces.size(), 0);
  }

  ThicknessRegions find() {
    Faces all(mesh_.faces.size());
    std::iota(all.begin(), all.end(), 0u);
    // What so many rays tell, to what all would.
    const double whole_mm = 2 * std::abs(signed_volume(mesh_)) / surface_area(mesh_);
    const double factor = whole_mm / mean_mm(all);
    for (double& chord : chord_mm_) chord *= factor;
    std::vector<Faces> pieces = parts_of(all);
    std::stable_sort(pieces.begin(), pieces.end(),
                     [&](const Faces& a, const Faces& b) { return area_mm2(a) > area_mm2(b); });
    for (const Faces& piece : pieces) {
      if (area_mm2(piece) < kSpeck * area_mm2(all)) break;  // they count for the first region
      smooth(piece, kReach * mean_mm(piece));
      add(piece);
    }
    return std::move(regions_);
  }

 private:
  double area_mm2(const Faces& faces) const {
    double sum = 0;
    for (const std::uint32_t f : faces) sum += area_mm2_[f];
    return sum;
  }
  double mean_mm(const Faces& faces) const {
    double sum = 0;
    for (const std::uint32_t f : faces) sum += area_mm2_[f] * chord_mm_[f];
    return sum / std::max(area_mm2(faces), 1e-300);
  }

  // What hangs together of some faces, by its lowest face.
  std::vector<Faces> parts_of(const Faces& faces) const {
    std::vector<char> among(mesh_.faces.size(), 0);
    for (const std::uint32_t f : faces) among[f] = 1;
    UnionFind together(mesh_.faces.size());
    for (const std::uint32_t f : faces)
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
        if (twins_[h] != kNoHalfEdge && among[twins_[h] / 3]) together.join(f, twins_[h] / 3);
    std::vector<Faces> parts;
    std::vector<std::uint32_t> part_of(mesh_.faces.size(), 0);
    for (const std::uint32_t f : faces) {
      const std::uint32_t root = together.root(f);
      if (root == f) {
        part_of[f] = static_cast<std::uint32_t>(parts.size());
        parts.emplace_back();
      }
      parts[part_of[root]].push_back(f);
    }
    return parts;
  }

  // One chord is long by chance; so is one of a sharp edge's few.
  void smooth(const Faces& piece, double reach_mm) {
    std::vector<Eigen::Vector3d> at(piece.size());
    Faces order(piece.size());
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t i = 0; i < piece.size(); ++i) at[i] = middle(mesh_, piece[i]);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return at[a].x() != at[b].x() ? at[a].x() < at[b].x() : a < b;
    });
    std::vector<double> smoothed_mm(piece.size());
    parallel_for(std::size_t{0}, piece.size(), [&](std::size_t i) {
      const Eigen::Vector3d here = at[i];
      auto first =
          std::lower_bound(order.begin(), order.end(), here.x() - reach_mm,
                           [&](std::uint32_t other, double x) { return at[other].x() < x; });
      double sum = 0, weight = 0;
      for (; first != order.end() && at[*first].x() <= here.x() + reach_mm; ++first) {
        if ((at[*first] - here).squaredNorm() > reach_mm * reach_mm) continue;
        const std::uint32_t face = piece[*first];
        sum += area_mm2_[face] * chord_mm_[face];
        weight += area_mm2_[face];
      }
      smoothed_mm[i] = weight > 0 ? sum / weight : chord_mm_[piece[i]];
    });
    for (std::size_t i = 0; i < piece.size(); ++i) chord_mm_[piece[i]] = smoothed_mm[i];
  }

  // A region of these faces, and those within it.
  void add(const Faces& faces) {
    const double thickness_mm = mean_mm(faces);
    const auto region = static_cast<std::uint32_t>(regions_.thickness_mm.size());
    regions_.thickness_mm.push_back(thickness_mm);
    for (const std::uint32_t f : faces) regions_.of_face[f] = region;
    Faces thin;
    for (const std::uint32_t f : faces)
      if (chord_mm_[f] < kThin * thickness_mm) thin.push_back(f);
    for (const Faces& part : parts_of(thin)) {
      const double part_mm = mean_mm(part);
      if (area_mm2(part) >= kSmallestArea * part_mm * part_mm) add(part);
    }
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> twins_;
  std::vector<double> chord_mm_, area_mm2_;
  ThicknessRegions regions_;
};

bool has_no_border(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> twins = half_edge_twins(mesh);
  return std::find(twins.begin(), twins.end(), kNoHalfEdge) == twins.end();
}

}  // namespace

ThicknessRegions thickness_regions(const TriangleMesh& surface, const RunContext& context) {
  if (surface.empty()) return {};
  const TriangleMesh sound = manifold_faces(surface);
  if (!has_no_border(sound) || signed_volume(sound) == 0) return {};
  const TriangleMesh thinned =
      sound.faces.size() > 2 * kFaces ? fast_collapse(sound, kFaces, context) : sound;
  const ThicknessRegions coarse = RegionSearch(thinned, context).find();
  ThicknessRegions regions{coarse.thickness_mm, {}};
  const RayScene scene(thinned);
  regions.of_face.resize(surface.faces.size());
  constexpr std::size_t kFacesAtOnce = 64;
  parallel_pieces(std::size_t{0}, surface.faces.size(), kFacesAtOnce,
                  [&](std::size_t first, std::size_t last) {
                    std::uint32_t near = kNoHit;  // faces that follow each other lie side by side
                    for (std::size_t f = first; f < last; ++f) {
                      near = scene.closest_point(middle(surface, f), near).face;
                      regions.of_face[f] = coarse.of_face[near];
                    }
                  });
  return regions;
}

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
      of_proxy[f] = of_surface[scene_.closest_point(middle(proxy, f)).face];
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
