// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What decimate() is made of: how far a proxy is off where the surface is thin, and more vertices
// there, until it serves. Below that, what a fit of a proxy to its surface is made of, from the
// frame in which it computes to fitted_proxy(), which takes all of it: the surface as samples, the
// equations' terms, all vertices at once, a patch of a few faces, and local changes of the mesh.

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

struct DecimateOptions;

// Gives vertices with hundreds of faces, such as the middle of a cap or the tip of a cone, fewer:
// spokes become edges between the spokes beside them, where no face turns by more than 60°. The
// mesh must be manifold; it stays so, with as many faces. Throws BadDataError where thousands stay.
void split_hubs(TriangleMesh& mesh);

// A body's parts that are thick each in its own way: an organ, and the vessels that leave it.
struct ThicknessRegions {
  std::vector<double> thickness_mm;    // of each; none where the surface has a border
  std::vector<std::uint32_t> of_face;  // the region of each face of the surface
};

// Thickness is 2 · volume / area: a plate's own, a long tube's radius, two thirds of a ball's. Its
// local form is half the mean chord through the body from a point of the surface, directions
// weighted by their cosine; over the whole surface that is 2 · volume / area again (Cauchy's
// formula, Santaló 1976). Each connected surface is a region; where a connected part of a region
// is less than half as thick as the region, and longer than wide, it is one of its own. The same
// for any number of threads.
ThicknessRegions thickness_regions(const TriangleMesh& surface, const RunContext& context = {});

// How far a proxy and its surface lie apart, and what that means where the surface is thin.
struct RegionErrors {
  double max_mm = 0, reverse_max_mm = 0;  // surface → proxy, proxy → surface: largest_distance()
  // Of the region where the larger of both is the largest share of its thickness; zeros where no
  // thickness is known.
  double worst_share = 0, worst_mm = 0, worst_thickness_mm = 0;
};

// A point of a proxy's face and the surface's point that it should be nearer to.
struct FarPoint {
  double share = 0;  // of the distance, of the thickness there
  Eigen::Vector3d on_surface = Eigen::Vector3d::Zero(), on_proxy = Eigen::Vector3d::Zero();
};

// Measures proxies of one surface, whose search tree is built once. Keeps references to the
// surface and its regions.
class RegionMeter {
 public:
  RegionMeter(const TriangleMesh& surface, const ThicknessRegions& regions)
      : surface_(surface), regions_(regions), scene_(surface) {}
  const RayScene& scene() const { return scene_; }  // of the surface
  RegionErrors measure(const TriangleMesh& proxy, const RunContext& context = {}) const;
  // For each face of the proxy the farthest point found among the surface's vertices and a lattice
  // on the face; share 0 where no thickness is known.
  std::vector<FarPoint> far_points(const TriangleMesh& proxy, const RunContext& context = {}) const;

 private:
  double share_at(std::uint32_t surface_face, double distance_mm) const {
    return distance_mm / regions_.thickness_mm[regions_.of_face[surface_face]];
  }

  const TriangleMesh& surface_;
  const ThicknessRegions& regions_;
  RayScene scene_;
};

// A proxy of at most `faces` by the method of the options. The surface must be
// manifold (manifold_faces()).
TriangleMesh proxy_with_faces(const TriangleMesh& surface, const DecimateOptions& options,
                              std::size_t faces, const RunContext& context = {});

// A proxy, and what the meter says of it.
struct MeasuredProxy {
  TriangleMesh mesh;
  RegionErrors errors = {};
};

// Where a few places of the first proxy lie off by more than options.max_share of the thickness,
// vertices are added there, each fitted with its neighbours; where it is too coarse as a whole,
// more faces are asked for, and the largest distance is what is lowered. The nearest of those
// tried, with options.most_faces at most. The surface must be the first proxy's and the meter's.
MeasuredProxy serving_proxy(const TriangleMesh& surface, TriangleMesh first,
                            const RegionMeter& meter, const DecimateOptions& options,
                            const RunContext& context = {});

// A mesh's bounds centred and scaled by a power of two to about 1, so that neither the place nor
// the unit of the data matters to thresholds.
struct UnitFrame {
  Eigen::Vector3d center;
  double scale = 1;

  explicit UnitFrame(const TriangleMesh& mesh) {
    const Bounds box = bounds(mesh);
    center = box.center();
    const double size = box.diagonal();
    if (size > 1e-150 && std::isfinite(size)) scale = std::scalbn(1.0, -std::ilogb(size));
  }
  Eigen::Vector3d into(const Eigen::Vector3d& point) const { return scale * (point - center); }
  Eigen::Vector3d back(const Eigen::Vector3d& point) const { return point / scale + center; }
  TriangleMesh into(TriangleMesh mesh) const {
    for (Eigen::Vector3d& v : mesh.vertices) v = into(v);
    return mesh;
  }
  TriangleMesh back(TriangleMesh mesh) const {
    for (Eigen::Vector3d& v : mesh.vertices) v = back(v);
    return mesh;
  }
};

// What a fit minimises: the sum of weight · distance^power over samples of both surfaces. Power 2
// is the squared RMS; a high power nears the largest distance.
struct FitNorm {
  double power = 2;
  double scale = 1;  // distances are divided by it, so that high powers stay in range

  double energy(double distance2) const {
    return power == 2 ? distance2 : std::pow(distance2 / (scale * scale), 0.5 * power);
  }
};

// One sample's share of the Gauss–Newton equations: its proxy point p = Σ wₖ xₖ shall close the
// gap to its target. Only the gap's direction counts – along the surface a proxy may slide – with
// a little of the rest, so that the equations stay regular.
struct FitTerm {
  Eigen::Matrix3d matrix;
  Eigen::Vector3d right;

  FitTerm(const Eigen::Vector3d& gap, const Eigen::Vector3d& face_normal, double weight,
          const FitNorm& norm) {
    constexpr double kSliding = 0.005;
    const double distance2 = gap.squaredNorm();
    const Eigen::Vector3d along =
        distance2 > 1e-24 ? Eigen::Vector3d(gap / std::sqrt(distance2)) : face_normal;
    double w = weight, newton = 1;
    if (norm.power != 2) {
      w *= std::pow(distance2 / (norm.scale * norm.scale) + 1e-12, 0.5 * norm.power - 1);
      newton = 1 / (norm.power - 1);
    }
    matrix = w * (along * along.transpose() + kSliding * Eigen::Matrix3d::Identity());
    right = (w * newton) * gap;
  }
};

// The original surface as a fit sees it: samples to be near to, and closest points.
class FitReference {
 public:
  // Samples come from `surface`, closest points from `thinned`, which stands for it: for proxies
  // far coarser than `thinned` the difference does not matter.
  FitReference(const TriangleMesh& surface, const TriangleMesh& thinned, std::size_t samples);

  const std::vector<Eigen::Vector3d>& samples() const { return samples_; }
  double sample_weight() const { return 1.0 / double(samples_.size()); }
  double area_mm2() const { return area_mm2_; }
  double volume_mm3() const { return volume_mm3_; }
  bool closed() const { return closed_; }

  ClosestPoint closest(const Eigen::Vector3d& point) const { return scene_->closest_point(point); }
  const Eigen::Vector3d& normal(std::uint32_t face) const { return (*normals_)[face]; }

  // The same with every k-th of the samples.
  FitReference every(std::size_t k) const;

  // Points on a proxy's face that are held against the surface: as dense as samples(), at least a
  // few; each stands for an equal share of the face's area.
  std::size_t points_on_face(double face_area_mm2) const;
  static Eigen::Vector3d weights_on_face(std::size_t i);  // barycentric, evenly spread

 private:
  std::vector<Eigen::Vector3d> samples_;
  double area_mm2_ = 0, volume_mm3_ = 0;
  bool closed_ = false;
  std::shared_ptr<const std::vector<Eigen::Vector3d>> normals_;
  std::shared_ptr<const RayScene> scene_;
};

struct FitOptions {
  int steps = 10;           // evaluations of all distances
  double power = 2;         // of the distance; see FitNorm
  bool keep_volume = true;  // of a closed surface
};

// Moves a proxy's vertices so that the two-sided sampled distance to the reference gets small
// (Gauss–Newton, closest points renewed at each step). No face turns over within a step, and
// slivers are kept from folding onto their neighbours; the result is the best of the iterates, at
// worst the proxy given. The same for any number of threads.
TriangleMesh fit_vertices(TriangleMesh proxy, const FitReference& reference,
                          const FitOptions& options, const RunContext& context = {});

// Largest distance from a sample to the other surface, either way.
double largest_distance(const TriangleMesh& proxy, const FitReference& reference);

// How much the volume grows when a vertex moves, one per vertex (mm²).
std::vector<Eigen::Vector3d> volume_gradient(const TriangleMesh& mesh);

inline constexpr std::size_t kMostFree = 5;  // vertices of a patch that may move

// Where a proxy's point meets the surface.
struct SurfacePoint {
  Eigen::Vector3d point, normal;
};
using FaceTargets = std::vector<SurfacePoint>;  // of FitReference's points on one face

// A few faces of a proxy, by themselves: what is refitted after a local change.
struct ProxyPatch {
  std::vector<Eigen::Vector3d> vertices;  // the first `free` may move, the others hold the rim
  std::size_t free = 0;
  std::vector<Face> faces;             // of `vertices`
  std::vector<std::uint32_t> samples;  // of the reference, that belong to the patch
  // Of the first faces, when they are known already: asking the surface is what costs time.
  std::vector<const FaceTargets*> targets;
};

struct PatchFit {
  double energy = 0;                 // of all faces; infinity when the patch is no good
  std::vector<double> face_energy;   // both sides, one a face
  std::vector<double> facing;        // mean cosine to the surface's normals, one a face
  std::vector<std::uint32_t> owner;  // each sample's face
  std::vector<FaceTargets> targets;  // of all faces
};

struct PatchFitOptions {
  int steps = 3;
  FitNorm norm;
  double give_up = 0;        // stop early when this energy is clearly out of reach; 0 = never
  bool keep_volume = true;   // the patch's share of it becomes volume_mm3
  double volume_mm3 = 0;     // patch_volume() that is to be kept
  double least_quality = 0;  // no face of a worse shape, see face_quality()
  double least_facing = 0;   // no face looks farther away from the surface beneath it
};

// Measures the patch and moves its free vertices by Gauss–Newton steps; between the first and the
// last measure, the surface stands in by its tangent planes.
// A patch that ends with a face that is no good has infinite energy.
PatchFit fit_patch(ProxyPatch& patch, const FitReference& reference,
                   const PatchFitOptions& options);

// The same without moving anything.
PatchFit measure_patch(ProxyPatch& patch, const FitReference& reference, const FitNorm& norm);

// Volume between the patch and a fixed point; the same for any patch with the same rim up to the
// space between the two.
double patch_volume(const ProxyPatch& patch, const Eigen::Vector3d& from);

// 1 for an equilateral triangle, 0 for one without area: 4√3 · area / Σ edge².
double face_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// A local change of a proxy: faces that go, faces that come, and the vertices round them that are
// fitted anew.
struct ProxyMove {
  std::vector<std::uint32_t> removed;
  std::vector<Face> added;
  std::vector<std::uint32_t> free;
  std::vector<Eigen::Vector3d> inserted;  // new vertices, numbered on from the last there is
};

// What a move would lead to, ready to be made.
struct ProxyTrial {
  ProxyMove move;
  double gain = 0;  // energy that it takes off; negative when it adds
  std::vector<std::uint32_t> old_faces, kept_faces;  // of the patch, before; those not removed
  ProxyPatch patch;
  PatchFit fit;
};

// A proxy under local changes, with the distance energy of every face kept up to date. Vertices and
// faces keep their numbers; dead ones are dropped by mesh(). Proxy and reference must be manifold.
class RefinedProxy {
 public:
  RefinedProxy(const TriangleMesh& proxy, const FitReference& reference, const FitNorm& norm,
               bool keep_volume);

  std::size_t face_count() const { return alive_; }
  double energy() const;
  const std::vector<Face>& faces() const { return faces_; }  // dead: all corners kDead
  const std::vector<std::uint32_t>& faces_round(std::uint32_t vertex) const {
    return around_[vertex];
  }
  bool has_edge(std::uint32_t a, std::uint32_t b) const { return adjacent(a, b); }
  static constexpr std::uint32_t kDead = 0xFFFFFFFFu;

  // Moves that keep the topology; nothing where there is none. Edge a→b as a face has it.
  std::optional<ProxyMove> flip(std::uint32_t a, std::uint32_t b) const;
  std::optional<ProxyMove> collapse(std::uint32_t a, std::uint32_t b) const;
  std::optional<ProxyMove> split(std::uint32_t a, std::uint32_t b) const;
  // A new vertex within a face.
  ProxyMove insert(std::uint32_t face, const Eigen::Vector3d& at) const;

  // Nothing when the refitted move leads to no good proxy, or to less than least_gain.
  std::optional<ProxyTrial> attempt(const ProxyMove& move, double least_gain) const;
  // False, and nothing done, when the surface would come to intersect itself.
  [[nodiscard]] bool make(const ProxyTrial& trial);

  TriangleMesh mesh() const;

 private:
  std::uint32_t opposite(std::uint32_t a, std::uint32_t b, std::uint32_t* face) const;
  bool adjacent(std::uint32_t a, std::uint32_t b) const;
  bool at_border(std::uint32_t v) const;
  ProxyPatch patch_of(const ProxyMove& move, const std::vector<std::uint32_t>& kept_faces,
                      std::vector<std::uint32_t>& global) const;
  bool intersects(const ProxyTrial& trial, const std::vector<std::uint32_t>& global) const;

  const FitReference* reference_;
  FitNorm norm_;
  bool keep_volume_;
  std::size_t alive_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Face> faces_;
  std::vector<std::vector<std::uint32_t>> around_;   // faces of each vertex
  std::vector<std::vector<std::uint32_t>> samples_;  // of each face
  std::vector<double> energy_;                       // of each face
  std::vector<double> facing_;                       // of each face, see PatchFit
  std::vector<FaceTargets> targets_;                 // of each face
};

// Flips edges and takes vertices from where they matter least to where one more helps most, each
// with the vertices round it refitted, as long as that takes off energy. Whether any did.
bool improve_by_moves(RefinedProxy& proxy, const RunContext& context = {});

// `after` with the vertices round any faces that meet others drawn back towards `before` (same
// faces, other places), until it meets itself no more than `before` does.
[[nodiscard]] TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after);

struct FittedOptions {
  std::size_t faces = 80;
  bool flips = true;     // of edges, up to kMostFacesToFlip
  bool largest = false;  // minimise the largest distance, not the RMS; the volume is free then
  bool thorough = true;  // largest: dense samples and many steps; a search can do with less
};

inline constexpr std::size_t kMostFacesToFlip = 500;
inline constexpr std::size_t kMostFacesToFit = 20'000;  // beyond, Lindstrom–Turk's answer stands

// A proxy of at most `faces` faces, fitted to a manifold surface (manifold_faces()): a fast
// pre-pass, Lindstrom–Turk on the rest, vertices moved to lower the two-sided distance with the
// volume kept, edges flipped where that lowers it further. Manifold, same genus and components;
// no face turns, and no step is kept that makes the proxy meet itself. More faces than asked for
// where the topology allows no fewer.
[[nodiscard]] TriangleMesh fitted_proxy(const TriangleMesh& surface, const FittedOptions& options,
                                        const RunContext& context = {});

}  // namespace organbake
