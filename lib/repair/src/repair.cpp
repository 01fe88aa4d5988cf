// SPDX-License-Identifier: GPL-3.0-or-later
// The stage: what is wrong with a surface is mended in the order in which each step relies on the
// one before, and every step is told. A wrap round everything is the last resort, since it alone
// loses detail and colours.
#include "organbake/repair/repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/core/union_find.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/raycast/face_queries.h"
#include "organbake/raycast/ray_scene.h"
#include "repair_steps.h"

namespace organbake {
namespace {

// Which patches of a surface are its outside: by how much of either side rays reach from outside.
// It asks nothing of the surface's topology, which is what is broken.

// The edges of a mesh in which other than two faces meet cut it into patches.
struct Patches {
  std::vector<std::uint32_t> of_face;  // a patch for every face
  std::size_t count = 0;
  std::vector<bool> at_crowded_edge;  // whether three or more faces meet at an edge of the patch
};

// How much of each side of the patches is seen from outside the mesh: share of rays from points
// spread over the patch that reach it. Front is where faces wind counter-clockwise; the winding
// within a patch must be consistent.
struct SeenShare {
  double front = 0, back = 0;
};

constexpr std::size_t kDirections = 32;     // a side, evenly over the half sphere
constexpr std::size_t kFacesOfPatch = 200;  // at most, spread over it

// Off the surface by more than the ray tracer's margin, 4e-6 of the size.
constexpr double kOff = 2e-5;

// Fibonacci's points on the half sphere round +z.
std::vector<Eigen::Vector3d> half_sphere() {
  std::vector<Eigen::Vector3d> all;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / kDirections;
    const double angle = static_cast<double>(i) * M_PI * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    all.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return all;
}

double free_share(const RayScene& scene, const Eigen::Vector3d& point,
                  const Eigen::Vector3d& normal, double off_mm) {
  static const std::vector<Eigen::Vector3d> directions = half_sphere();
  const Eigen::Quaterniond turn = rotation_between(Eigen::Vector3d::UnitZ(), normal);
  std::vector<Ray> rays(kDirections);
  for (std::size_t i = 0; i < kDirections; ++i) {
    rays[i].origin = point + off_mm * normal;
    rays[i].direction = turn * directions[i];
  }
  std::vector<std::uint8_t> blocked(kDirections);
  scene.occluded(rays, blocked);
  return static_cast<double>(std::count(blocked.begin(), blocked.end(), 0)) / kDirections;
}

Patches patches_of(const TriangleMesh& mesh) {
  UnionFind joined(mesh.faces.size());
  std::vector<std::uint32_t> crowded;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 2) joined.join(uses[0].face(), uses[1].face());
    if (uses.size() <= 2) return;
    for (const EdgeUse& use : uses) crowded.push_back(use.face());
  });
  Patches patches;
  std::vector<std::uint32_t> number(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const std::uint32_t root = joined.root(f);
    if (root == f) number[f] = static_cast<std::uint32_t>(patches.count++);
    patches.of_face.push_back(number[root]);
  }
  patches.at_crowded_edge.assign(patches.count, false);
  for (const std::uint32_t f : crowded) patches.at_crowded_edge[patches.of_face[f]] = true;
  return patches;
}

std::vector<SeenShare> seen_from_outside(const TriangleMesh& mesh, const Patches& patches) {
  std::vector<std::vector<std::uint32_t>> faces(patches.count);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (face_area(mesh, f) > 0) faces[patches.of_face[f]].push_back(f);
  }
  const RayScene scene(mesh);
  const double off_mm = kOff * bounds(mesh).diagonal();
  std::vector<SeenShare> seen(patches.count);
  parallel_for(std::size_t{0}, patches.count, [&](std::size_t patch) {
    const auto& own = faces[patch];
    const std::size_t step = std::max<std::size_t>(1, own.size() / kFacesOfPatch);
    std::size_t looked = 0;
    for (std::size_t i = step / 2; i < own.size(); i += step, ++looked) {
      const Face& face = mesh.faces[own[i]];
      const Eigen::Vector3d middle =
          (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3;
      const Eigen::Vector3d normal = face_normal(mesh, own[i]);
      seen[patch].front += free_share(scene, middle, normal, off_mm);
      seen[patch].back += free_share(scene, middle, -normal, off_mm);
    }
    if (looked == 0) return;
    seen[patch].front /= static_cast<double>(looked);
    seen[patch].back /= static_cast<double>(looked);
  });
  return seen;
}

// Of the diagonal: what lies so near to a line lies on it; as weld() takes places for the same.
constexpr double kSameLine = 1e-6;
constexpr double kHoleShare = 0.1, kWrapShare = 0.01;  // of the surface's diagonal, by default
// A side that fewer rays reach is not seen: what comes through pinholes and gaps of rounding.
constexpr double kSeen = 0.005;

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

bool sound(const MeshTopology& topology) {
  return topology.non_manifold_edges == 0 && topology.misoriented_edges == 0 &&
         topology.non_manifold_vertices == 0 && topology.faces > 0;
}

long genus_of(const MeshTopology& topology, std::size_t loops) {
  return (2 * static_cast<long>(topology.components) - static_cast<long>(loops) -
          topology.euler_characteristic) /
         2;
}

class Repair {
 public:
  Repair(const TriangleMesh& surface, const RepairOptions& options, const RunContext& context)
      : options_(options), context_(context), mesh_(surface) {
    diagonal_mm_ = bounds(surface).diagonal();
  }

  RepairSummary run() {
    drop_degenerate();
    drop_duplicates();
    close_slits();
    told(wind_alike(mesh_), "face that was wound against its neighbours turned",
         "faces that were wound against their neighbours turned");
    drop_unseen_patches();
    told(split_edges(mesh_), "vertex where parts touched split",
         "vertices where parts touched split");
    context_.throw_if_cancelled();
    unite_overlaps();
    turn_pieces_outward();
    note_volume();
    drop_islands();
    reference_ = mesh_;
    close_small_holes();
    note_volume();
    wrap_if_needed();
    finish();
    check_volume();
    return std::move(summary_);
  }

 private:
  void told(std::size_t count, const std::string& one, const std::string& many) {
    if (count > 0) summary_.done.push_back(counted(count, one, many));
  }

  void drop_faces_if(const std::function<bool(std::size_t)>& drop, const std::string& one,
                     const std::string& many) {
    std::vector<Face> kept;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      if (!drop(f)) kept.push_back(mesh_.faces[f]);
    }
    told(mesh_.faces.size() - kept.size(), one, many);
    mesh_.faces = std::move(kept);
    if (mesh_.faces.empty()) throw BadDataError("surface to repair: nothing is left of it");
  }

  void drop_degenerate() {
    drop_faces_if(
        [&](std::size_t f) {
          const Face& face = mesh_.faces[f];
          return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
        },
        "face without an area dropped", "faces without an area dropped");
  }

  void drop_duplicates() {
    std::set<Face> seen;
    drop_faces_if(
        [&](std::size_t f) {
          Face sorted = mesh_.faces[f];
          std::sort(sorted.begin(), sorted.end());
          return !seen.insert(sorted).second;
        },
        "duplicate face dropped", "duplicate faces dropped");
  }

  // Faces that are lines, and edges cut on one side only. A surface in order may keep its own.
  void close_slits() {
    if (sound(analyse_topology(mesh_)) && analyse_topology(mesh_).boundary_edges == 0) return;
    const double within_mm = kSameLine * diagonal_mm_;
    told(drop_slivers(mesh_, within_mm), "face as thin as a line dropped",
         "faces as thin as a line dropped");
    if (mesh_.faces.empty()) throw BadDataError("surface to repair: nothing is left of it");
    told(cut_at_touching_vertices(mesh_, within_mm), "edge cut where a vertex lies on it",
         "edges cut where vertices lie on them");
    drop_duplicates();
  }

  // At crowded edges rays from outside tell what is skin: of that one side alone is seen. A wall
  // inside is seen from no side, a fin outside from both.
  void drop_unseen_patches() {
    const Patches patches = patches_of(mesh_);
    if (std::none_of(patches.at_crowded_edge.begin(), patches.at_crowded_edge.end(),
                     [](bool crowded) { return crowded; })) {
      return;
    }
    const std::vector<SeenShare> seen = seen_from_outside(mesh_, patches);
    const std::size_t open_before = analyse_topology(mesh_).boundary_edges;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      const std::uint32_t patch = patches.of_face[f];
      if (patches.at_crowded_edge[patch] && seen[patch].back > seen[patch].front) {
        std::swap(mesh_.faces[f][1], mesh_.faces[f][2]);
      }
    }
    drop_faces_if(
        [&](std::size_t f) {
          const SeenShare& share = seen[patches.of_face[f]];
          const bool crowded = patches.at_crowded_edge[patches.of_face[f]];
          return crowded && std::max(share.front, share.back) < kSeen;
        },
        "face of walls inside dropped", "faces of walls inside dropped");
    drop_fins(open_before);
  }

  // A fin has a free rim; where dropping it leaves fewer open edges, it was one.
  void drop_fins(std::size_t open_before) {
    const Patches patches = patches_of(mesh_);
    const std::vector<SeenShare> seen = seen_from_outside(mesh_, patches);
    TriangleMesh without = mesh_;
    without.faces.clear();
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      const SeenShare& share = seen[patches.of_face[f]];
      const bool fin =
          patches.at_crowded_edge[patches.of_face[f]] && std::min(share.front, share.back) >= kSeen;
      if (!fin) without.faces.push_back(mesh_.faces[f]);
    }
    const std::size_t gone = mesh_.faces.size() - without.faces.size();
    if (gone == 0 || without.faces.empty()) return;
    if (analyse_topology(without).boundary_edges >= std::max<std::size_t>(1, open_before)) return;
    told(gone, "face of a fin dropped", "faces of fins dropped");
    mesh_ = std::move(without);
  }

  void unite_overlaps() {
    const UnitedPieces united = unite_overlapping_pieces(mesh_);
    if (united.pieces == 0) return;
    cannot_unite_ = united.refused;
    shared_mm3_ = united.shared_mm3;
    if (united.refused) return;
    split_edges(mesh_);
    summary_.done.push_back(std::to_string(united.pieces) +
                            " overlapping pieces united: " + to_text(united.shared_mm3 / 1000, 2) +
                            " ml that they share count once");
  }

  void turn_pieces_outward() {
    for (const std::string& turned : turn_outward(mesh_).sentences())
      summary_.done.push_back(turned);
  }

  // Once it has one: what the surface holds before anything is added to it or taken from it.
  void note_volume() {
    if (volume_mm3_ || !analyse_topology(mesh_).closed_manifold()) return;
    volume_mm3_ = signed_volume(mesh_);
  }

  void drop_islands() {
    if (!(options_.island_share > 0)) return;
    const std::vector<double> areas = component_areas(mesh_);
    const auto islands =
        static_cast<std::size_t>(std::count_if(areas.begin(), areas.end(), [&](double area) {
          return area < options_.island_share * areas.front();
        }));
    if (islands == 0) return;
    mesh_ = largest_components(mesh_, areas.size() - islands);
    told(islands, "island dropped", "islands dropped");
  }

  void close_small_holes() {
    if (!sound(analyse_topology(mesh_))) return;
    const double largest_mm = options_.hole_mm > 0 ? options_.hole_mm : kHoleShare * diagonal_mm_;
    const ClosedHoles holes = close_holes(mesh_, largest_mm);
    told(holes.closed, "hole closed", "holes closed");
    summary_.open_loops = holes.left;
    if (holes.left > 0) {
      summary_.done.push_back(counted(holes.left, "hole", "holes") + " wider than " +
                              to_text(largest_mm, 1) + " mm left open");
    }
  }

  void wrap_if_needed() {
    const MeshTopology topology = analyse_topology(mesh_);
    const long genus = genus_of(topology, summary_.open_loops);
    const bool tunnels = summary_.open_loops == 0 && genus > options_.most_tunnels;
    if (sound(topology) && !tunnels && !cannot_unite_) return;
    const double closes_mm = options_.wrap_mm > 0 ? options_.wrap_mm : kWrapShare * diagonal_mm_;
    TriangleMesh wrap = wrapped_surface(mesh_, closes_mm);
    if (wrap.empty() || !sound(analyse_topology(wrap))) {
      throw BadDataError("surface to repair: what is left is no manifold, and a wrap of " +
                         to_text(closes_mm, 2) + " mm finds no inside; close it in a mesh editor");
    }
    mesh_ = largest_components(wrap, 1);
    summary_.wrapped = true;
    summary_.open_loops = 0;
    summary_.done.push_back(
        (tunnels         ? counted(static_cast<std::size_t>(genus), "tunnel was", "tunnels were")
         : cannot_unite_ ? std::string("pieces that overlap and cross themselves were")
                         : std::string("what was left was no manifold and was")) +
        " closed by a wrap of " + to_text(closes_mm, 2) + " mm");
  }

  void finish() {
    const MeshTopology topology = analyse_topology(mesh_);
    summary_.genus = genus_of(topology, summary_.open_loops);
    summary_.max_mm = largest_distance(reference_, mesh_, RayScene(mesh_), context_);
    summary_.reverse_max_mm = largest_distance(mesh_, reference_, RayScene(reference_), context_);
    summary_.mesh = std::move(mesh_);
  }

  // Of overlapping pieces that could not be united the volume is known within bounds.
  void check_volume() {
    if (!volume_mm3_ || !(*volume_mm3_ > 0)) return;
    const double after_mm3 = signed_volume(summary_.mesh);
    const double least_mm3 = *volume_mm3_ - (cannot_unite_ ? shared_mm3_ : 0);
    const double before_mm3 = std::clamp(after_mm3, least_mm3, *volume_mm3_);
    summary_.volume_change = after_mm3 / before_mm3 - 1;
    constexpr double kWorthSaying = 0.01;
    if (std::abs(summary_.volume_change) <= kWorthSaying) return;
    const std::string change = "the volume changes by " + percent(summary_.volume_change, 1) +
                               ", from " + to_text(before_mm3 / 1000, 2) + " to " +
                               to_text(after_mm3 / 1000, 2) + " ml";
    if (std::abs(summary_.volume_change) > options_.volume_change)
      throw BadDataError("surface to repair: " + change + ", more than volume_change = " +
                         to_text(options_.volume_change) + " allows (" +
                         (summary_.done.empty() ? std::string("") : summary_.done.back()) +
                         "); mend it in a mesh editor, or allow more");
    context_.warn(change);
  }

  const RepairOptions& options_;
  const RunContext& context_;
  TriangleMesh mesh_, reference_;
  double diagonal_mm_ = 0, shared_mm3_ = 0;
  std::optional<double> volume_mm3_;
  bool cannot_unite_ = false;
  RepairSummary summary_;
};

}  // namespace

RepairSummary repair(const TriangleMesh& surface, const RepairOptions& options,
                     const RunContext& context) {
  check_mesh(surface, "surface to repair");
  if (surface.empty()) throw BadDataError("surface to repair: it has no faces");
  return Repair(surface, options, context).run();
}

}  // namespace organbake
