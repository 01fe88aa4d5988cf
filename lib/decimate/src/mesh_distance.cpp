// SPDX-License-Identifier: GPL-3.0-or-later
// Distances between surfaces: means over stratified samples, and the one-sided Hausdorff distance
// by branch and bound.
//
// A piece of a face is bounded from above by what its corners measure and its size, or by a single
// triangle of the other surface, distance to which is convex; pieces whose bound lies below the
// best found are never cut. Samples alone would give a lower bound only.
#include "organbake/decimate/mesh_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

constexpr std::size_t kBlock = 512;  // samples summed in one go; fixes the order of summation

struct Sums {
  double sum = 0, sum2 = 0, max = 0;
  void add(double distance) {
    sum += distance;
    sum2 += distance * distance;
    max = std::max(max, distance);
  }
  void add(const Sums& other) {
    sum += other.sum;
    sum2 += other.sum2;
    max = std::max(max, other.max);
  }
};

constexpr double kSlack = 0.0005;        // of the distance: far below what a reader could notice
constexpr double kSmallestShare = 1e-6;  // of the size: distances below are as good as none
constexpr int kDeepest = 10;             // pieces have at least 1/1024 of a face's edge
// Between flat surfaces that lie in one another a face over several would be cut everywhere, a
// million times. Where all distances are so small a share of a face's edge, and it takes more than
// its part of so many pieces, it is cut less deep.
constexpr double kFlatShare = 1.0 / 64;
constexpr std::size_t kPiecesOfAll = 2'000'000, kFewestPieces = 64, kMostPieces = 4096;
constexpr std::size_t kFacesAtOnce = 64;

using Corners = std::array<Eigen::Vector3d, 3>;

Corners corners_of(const TriangleMesh& mesh, std::size_t face) {
  const Face& f = mesh.faces[face];
  return {mesh.vertices[f[0]], mesh.vertices[f[1]], mesh.vertices[f[2]]};
}

// The distance to one triangle is convex: over a piece it is largest at a corner.
double to_one_triangle_mm(const Corners& piece, const TriangleMesh& to, std::uint32_t face) {
  const Corners triangle = corners_of(to, face);
  double largest_mm = 0;
  for (const Eigen::Vector3d& corner : piece) {
    const Eigen::Vector3d w = nearest_on_triangle(corner, triangle[0], triangle[1], triangle[2]);
    const Eigen::Vector3d nearest = w[0] * triangle[0] + w[1] * triangle[1] + w[2] * triangle[2];
    largest_mm = std::max(largest_mm, (corner - nearest).norm());
  }
  return largest_mm;
}

double longest_edge_mm(const Corners& face) {
  return std::max(
      {(face[1] - face[0]).norm(), (face[2] - face[1]).norm(), (face[0] - face[2]).norm()});
}

// Raises `upper_mm` to a bound of the distances of one face's points.
class FaceSearch {
 public:
  FaceSearch(const TriangleMesh& to, const RayScene& scene, double found_mm, double smallest_mm,
             std::size_t most_pieces, int deepest = kDeepest)
      : to_(to),
        scene_(scene),
        found_mm_(found_mm),
        smallest_mm_(smallest_mm),
        upper_mm_(found_mm),
        most_pieces_(most_pieces),
        deepest_(deepest) {}

  // likely: a face that may be the nearest to the piece's middle.
  void search(const Corners& piece, std::uint32_t likely = kNoHit, int depth = 0) {
    if (++pieces_ > most_pieces_) return;
    const Eigen::Vector3d center = (piece[0] + piece[1] + piece[2]) / 3;
    const ClosestPoint at_center = scene_.closest_point(center, likely);
    found_mm_ = std::max(found_mm_, at_center.distance_mm);
    upper_mm_ = std::max(upper_mm_, found_mm_);
    const double bound_mm = bound(piece, center, at_center);
    const double enough_mm = std::max(found_mm_ * (1 + kSlack), smallest_mm_);
    if (bound_mm <= enough_mm) {
      upper_mm_ = std::max(upper_mm_, bound_mm);
      return;
    }
    // Where coplanar faces meet the bound stays as large as the piece: what was measured counts.
    if (depth == deepest_) return;
    const Eigen::Vector3d ab = 0.5 * (piece[0] + piece[1]), bc = 0.5 * (piece[1] + piece[2]),
                          ca = 0.5 * (piece[2] + piece[0]);
    for (const Corners& quarter : {Corners{ab, bc, ca}, Corners{piece[0], ab, ca},
                                   Corners{ab, piece[1], bc}, Corners{ca, bc, piece[2]}}) {
      search(quarter, at_center.face, depth + 1);
    }
  }
  double upper_mm() const { return upper_mm_; }
  bool ended() const { return pieces_ <= most_pieces_; }

 private:
  // The distance grows by at most a millimetre a millimetre; and the distance to one triangle is
  // convex, so that over the piece it is largest at a corner.
  double bound(const Corners& piece, const Eigen::Vector3d& center, const ClosestPoint& near) {
    double radius_mm = 0;
    for (const Eigen::Vector3d& corner : piece)
      radius_mm = std::max(radius_mm, (corner - center).norm());
    double bound_mm =
        std::min(near.distance_mm + radius_mm, to_one_triangle_mm(piece, to_, near.face));
    if (bound_mm <= found_mm_ * (1 + kSlack)) return bound_mm;
    // A triangle smaller than the piece lies below one corner only: it bounds less than the middle.
    if (longest_edge_mm(corners_of(to_, near.face)) < radius_mm) return bound_mm;
    for (const Eigen::Vector3d& corner : piece)
      bound_mm = std::min(
          bound_mm, to_one_triangle_mm(piece, to_, scene_.closest_point(corner, near.face).face));
    return bound_mm;
  }

  const TriangleMesh& to_;
  const RayScene& scene_;
  double found_mm_, smallest_mm_, upper_mm_;
  std::size_t most_pieces_, pieces_ = 0;
  int deepest_;
};

// The depth to which `pieces` of a face suffice: 1 + 4 + 16 …
int depth_of(std::size_t pieces) {
  int depth = 0;
  for (std::size_t all = 1; 4 * all + 1 <= pieces; all = 4 * all + 1) ++depth;
  return depth;
}

// What the vertices of faces lie nearest to; the others are left out.
std::vector<ClosestPoint> closest_to_vertices(const TriangleMesh& from, const RayScene& scene,
                                              const RunContext& context) {
  std::vector<std::uint8_t> is_used(from.vertices.size(), 0);
  for (const Face& face : from.faces)
    for (const std::uint32_t vertex : face) is_used[vertex] = 1;
  std::vector<ClosestPoint> closest(from.vertices.size());
  parallel_pieces(std::size_t{0}, closest.size(), kFacesAtOnce,
                  [&](std::size_t first, std::size_t last) {
                    context.throw_if_cancelled();
                    std::uint32_t near = kNoHit;  // those that follow each other lie side by side
                    for (std::size_t v = first; v < last; ++v) {
                      if (!is_used[v]) continue;
                      closest[v] = scene.closest_point(from.vertices[v], near);
                      near = closest[v].face;
                    }
                  });
  return closest;
}

// Whether a face may reach beyond `limit_mm`, by what its corners lie nearest to: nothing more is
// asked of the other surface.
bool may_exceed(double limit_mm, const Corners& corners, const std::array<ClosestPoint, 3>& near,
                const TriangleMesh& to) {
  const double nearest_mm =
      std::min({near[0].distance_mm, near[1].distance_mm, near[2].distance_mm});
  if (nearest_mm + longest_edge_mm(corners) <= limit_mm) return false;
  return std::none_of(near.begin(), near.end(), [&](const ClosestPoint& at_corner) {
    return to_one_triangle_mm(corners, to, at_corner.face) <= limit_mm;
  });
}

// The largest at(face) of each group's faces.
template <typename At>
std::vector<double> largest_of(const FaceGroups& groups, const RunContext& context, const At& at) {
  std::vector<double> of_face(groups.of_face.size());
  parallel_pieces(std::size_t{0}, of_face.size(), kFacesAtOnce,
                  [&](std::size_t first, std::size_t last) {
                    context.throw_if_cancelled();
                    for (std::size_t f = first; f < last; ++f) of_face[f] = at(f);
                  });
  std::vector<double> largest(groups.count, 0.0);
  for (std::size_t f = 0; f < of_face.size(); ++f)
    largest[groups.of_face[f]] = std::max(largest[groups.of_face[f]], of_face[f]);
  return largest;
}

}  // namespace

MeshDistance mesh_distance(const TriangleMesh& from, const RayScene& to, std::size_t samples,
                           std::uint64_t seed, const RunContext& context) {
  check_mesh(from, "mesh to measure from");
  samples = std::max<std::size_t>(samples, 1);
  const AreaSampler sample(from, samples, seed);
  std::vector<Sums> blocks((samples + kBlock - 1) / kBlock);
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    context.throw_if_cancelled();
    for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, samples); ++i) {
      blocks[b].add(to.closest_point(sample(i)).distance_mm);
    }
  });
  // In the blocks' order, whichever thread was first: the sum is the same to the last bit.
  Sums all;
  for (const Sums& block : blocks) all.add(block);
  return {all.sum / samples, std::sqrt(all.sum2 / samples), all.max};
}

double largest_distance(const TriangleMesh& from, const TriangleMesh& to, const RayScene& scene,
                        const RunContext& context) {
  const std::vector<std::uint32_t> one_group(from.faces.size(), 0);
  return largest_distances(from, {one_group, 1}, to, scene, context).front();
}

std::vector<double> largest_distances(const TriangleMesh& from, const FaceGroups& groups,
                                      const TriangleMesh& to, const RayScene& scene,
                                      const RunContext& context) {
  check_mesh(from, "mesh to measure from");
  const double smallest_mm = kSmallestShare * bounds(to).diagonal();
  const std::size_t over_flat =
      std::clamp(kPiecesOfAll / (from.faces.size() + 1), kFewestPieces, kMostPieces);
  // All faces start from what their group's corners and, where a face may reach beyond those, its
  // middle show, so that few have to be searched.
  const std::vector<ClosestPoint> at_vertex = closest_to_vertices(from, scene, context);
  const auto at_corners = [&](std::size_t f) {
    const Face& face = from.faces[f];
    return std::array{at_vertex[face[0]], at_vertex[face[1]], at_vertex[face[2]]};
  };
  const std::vector<double> corners_mm = largest_of(groups, context, [&](std::size_t f) {
    const auto near = at_corners(f);
    return std::max({near[0].distance_mm, near[1].distance_mm, near[2].distance_mm});
  });
  std::vector<std::uint8_t> may_reach_beyond(from.faces.size());
  const std::vector<double> found_mm = largest_of(groups, context, [&](std::size_t f) {
    const double start_mm = corners_mm[groups.of_face[f]];
    const Corners c = corners_of(from, f);
    may_reach_beyond[f] = may_exceed(start_mm, c, at_corners(f), to);
    if (!may_reach_beyond[f]) return start_mm;
    const std::uint32_t near = at_vertex[from.faces[f][0]].face;
    return std::max(start_mm, scene.closest_point((c[0] + c[1] + c[2]) / 3, near).distance_mm);
  });
  return largest_of(groups, context, [&](std::size_t f) {
    const double start_mm = found_mm[groups.of_face[f]];
    if (!may_reach_beyond[f]) return start_mm;
    // What may reach beyond is searched piece by piece. Between flat surfaces that lie in one
    // another this would hardly end: it is given up there, and done again as deep as can be
    // afforded.
    const Corners face = corners_of(from, f);
    const bool is_flat = start_mm < kFlatShare * longest_edge_mm(face);
    FaceSearch search(to, scene, start_mm, smallest_mm, is_flat ? over_flat : SIZE_MAX);
    search.search(face, at_vertex[from.faces[f][0]].face);
    if (search.ended()) return search.upper_mm();
    FaceSearch less_deep(to, scene, start_mm, smallest_mm, over_flat, depth_of(over_flat));
    less_deep.search(face);
    return less_deep.upper_mm();
  });
}

}  // namespace organbake
