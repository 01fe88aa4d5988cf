// SPDX-License-Identifier: GPL-3.0-or-later
// A proxy fitted to a surface, from coarse to fine decisions: a fast pre-pass, Lindstrom & Turk's
// collapses (1998), folded slivers laid flat, vertices by least squares (vertex_fit.cpp), then
// flips and relocations of single vertices (proxy_moves.cpp). For the largest distance the same
// with rising powers of the distances, which come near the maximum step by step, for it has no
// slope to follow.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/geometry/mesh_edges.h"
#include "proxies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Folded slivers are laid flat by edge flips, each of which must flatten the sharpest edge
// concerned: the sharpest edge of the whole falls, so that the flips end.

// Faces over one edge are folded when their normals are farther apart than a right angle.
constexpr double kFoldedCosine = 0;
constexpr double kLeastGain = 1e-3;  // of the cosine: rounding flips nothing to and fro
// The most that a flip may move the surface, as a share of the flipped edge.
constexpr double kMostMoved = 0.1;

// A mesh whose edges can be flipped, with the face on the left of each directed edge.
class Flippable {
 public:
  explicit Flippable(TriangleMesh& mesh) : mesh_(mesh) {
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) enter(f);
  }

  // Whether the face and its neighbour beyond the edge from its k-th corner look apart.
  bool folded(std::uint32_t f, int k) const {
    const Face& face = mesh_.faces[f];
    const std::uint32_t there = left_of(face[(k + 1) % 3], face[k]);
    return there != kNoFace && cosine(normal(face), normal(mesh_.faces[there])) < kFoldedCosine;
  }
  // Flips the edge if that lays its faces flatter.
  bool flip_if_flatter(std::uint32_t f, int k);

 private:
  static constexpr std::uint32_t kNoFace = 0xFFFFFFFFu;

  static std::uint64_t key(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }
  void enter(std::uint32_t f) {
    const Face& face = mesh_.faces[f];
    for (int k = 0; k < 3; ++k) left_[key(face[k], face[(k + 1) % 3])] = f;
  }
  std::uint32_t left_of(std::uint32_t from, std::uint32_t to) const {
    const auto found = left_.find(key(from, to));
    return found == left_.end() ? kNoFace : found->second;
  }
  const Vector3d& point(std::uint32_t vertex) const { return mesh_.vertices[vertex]; }
  Vector3d normal(const Face& face) const {
    return (point(face[1]) - point(face[0])).cross(point(face[2]) - point(face[0]));
  }
  // −1 for a face of no area: it is as bad as a fold.
  static double cosine(const Vector3d& a, const Vector3d& b) {
    const double lengths = a.norm() * b.norm();
    return lengths > 0 ? a.dot(b) / lengths : -1;
  }

  TriangleMesh& mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> left_;
};

bool Flippable::flip_if_flatter(std::uint32_t f, int k) {
  // Faces (a, b, c) and (b, a, d) become (a, d, c) and (b, c, d).
  const Face& face = mesh_.faces[f];
  const std::uint32_t a = face[k], b = face[(k + 1) % 3], c = face[(k + 2) % 3];
  const std::uint32_t g = left_of(b, a);
  if (g == kNoFace) return false;
  std::uint32_t d = 0;
  for (const std::uint32_t v : mesh_.faces[g])
    if (v != a && v != b) d = v;
  if (c == d || left_of(c, d) != kNoFace || left_of(d, c) != kNoFace) return false;

  const Vector3d abc = normal({a, b, c}), bad = normal({b, a, d});
  const Vector3d adc = normal({a, d, c}), bcd = normal({b, c, d});
  const double volume = std::abs(abc.dot(point(d) - point(a)));
  const double largest = std::max(adc.norm(), bcd.norm());
  if (volume > kMostMoved * (point(b) - point(a)).norm() * largest) return false;
  double before = cosine(abc, bad), after = cosine(adc, bcd);
  const auto outside = [&](std::uint32_t outer, const Vector3d& was, const Vector3d& becomes) {
    if (outer == kNoFace) return;
    const Vector3d there = normal(mesh_.faces[outer]);
    before = std::min(before, cosine(was, there));
    after = std::min(after, cosine(becomes, there));
  };
  outside(left_of(c, b), abc, bcd), outside(left_of(a, c), abc, adc);
  outside(left_of(d, a), bad, adc), outside(left_of(b, d), bad, bcd);
  if (after < before + kLeastGain) return false;

  left_.erase(key(a, b)), left_.erase(key(b, a));
  mesh_.faces[f] = {a, d, c};
  mesh_.faces[g] = {b, c, d};
  enter(f), enter(g);
  return true;
}

// Flips edges of slivers that lie folded over onto their neighbours, as edge collapses by cost
// alone leave them: they face the wrong way, and what is bound to them is drawn inside out. Looked
// at are faces more than a right angle from a neighbour. An edge of theirs is flipped where the
// sharpest of the edges concerned gets flatter and the surface hardly moves: a real ridge stays.
// The mesh must be manifold; it stays so. Returns the number of flips.
std::size_t unfold_faces(TriangleMesh& mesh) {
  if (!manifold_twins(mesh)) return 0;
  Flippable flippable(mesh);
  constexpr int kMostSweeps = 8;
  std::size_t flips = 0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    const std::size_t before = flips;
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
      for (int k = 0; k < 3; ++k) {
        if (!flippable.folded(f, k)) continue;
        for (int edge = 0; edge < 3; ++edge) flips += flippable.flip_if_flatter(f, edge);
      }
    if (flips == before) break;
  }
  return flips;
}

}  // namespace

namespace {

// The pre-pass leaves so many faces that fitting to them is as good as to all, and goes on to so
// many that Lindstrom–Turk's answer, once fitted, is as good as from all.
constexpr std::size_t kFewestToFit = 8'000, kFewestToBegin = 2'500, kThinnedPerFace = 8;
// Samples a side: many a face, so that no face fits the noise between its samples.
constexpr std::size_t kFewestSamples = 5'500, kSamplesPerFace = 16;
constexpr std::size_t kTrialStride = 2;  // trials of local changes make do with every second
// The largest distance hides between samples: it takes more of them.
constexpr std::size_t kDenser = 4;

// Moves vertices by one fit; what would make the proxy meet itself is taken back, and the rest
// fitted again round it.
void fit(TriangleMesh& proxy, const FitReference& reference, FitOptions options,
         const RunContext& context) {
  constexpr int kRounds = 3, kStepsAgain = 4;
  for (int round = 0; round < kRounds; ++round) {
    const TriangleMesh wanted = fit_vertices(proxy, reference, options, context);
    proxy = keep_apart(proxy, wanted);
    if (proxy.vertices == wanted.vertices) return;
    options.steps = kStepsAgain;
  }
  // One step moves nothing but what the volume still lacks.
  options.steps = 1;
  const TriangleMesh whole = fit_vertices(proxy, reference, options, context);
  if (self_intersecting_faces(whole).size() <= self_intersecting_faces(proxy).size()) {
    proxy = whole;
  }
}

FitNorm norm_of(const TriangleMesh& proxy, const FitReference& reference, double power) {
  return {.power = power, .scale = power == 2 ? 1 : largest_distance(proxy, reference)};
}

// Flips and relocations by the energy of one power, then all vertices together.
void improve_faces(TriangleMesh& proxy, const FitReference& reference, const FitOptions& options,
                   std::size_t stride, const RunContext& context) {
  const FitReference trials = reference.every(stride);
  RefinedProxy refined(proxy, trials, norm_of(proxy, reference, options.power),
                       options.keep_volume);
  if (!improve_by_moves(refined, context)) return;
  proxy = refined.mesh();
  fit(proxy, reference, options, context);
}

// From the squared distance to its higher powers, each from where the last one ended.
void lower_the_largest(TriangleMesh& proxy, const FitReference& reference, bool flips,
                       bool thorough, const RunContext& context) {
  FitOptions options{.steps = thorough ? 10 : 6, .keep_volume = false};
  const auto fit_with = [&](double power) {
    options.power = power;
    fit(proxy, reference, options, context);
  };
  fit_with(4);
  if (thorough) fit_with(8);
  if (flips) improve_faces(proxy, reference, options, kDenser * kTrialStride, context);
  fit_with(16);
  if (thorough) fit_with(32);
}

TriangleMesh thin(const TriangleMesh& surface, std::size_t fewest, std::size_t faces,
                  const RunContext& context) {
  const std::size_t to = std::max(fewest, kThinnedPerFace * faces);
  // Short of twice as many faces, thinning saves less than it may cost in quality.
  return surface.faces.size() > 2 * to ? fast_collapse(surface, to, context) : surface;
}

TriangleMesh collapsed(const TriangleMesh& surface, std::size_t faces, const RunContext& context) {
  TriangleMesh proxy = collapse_edges(surface, faces, context);
  const std::size_t flips = unfold_faces(proxy);
  context.debug("fitted: " + std::to_string(flips) + " edges of folded faces flipped");
  return proxy;
}

// Lindstrom–Turk's proxy of the thinned surface. Where that meets itself, others are tried: from
// surfaces thinned further, the same collapses end elsewhere.
TriangleMesh start_of(const TriangleMesh& thinned, std::size_t faces, const RunContext& context) {
  constexpr int kAttempts = 4;
  constexpr std::size_t kLeastPerFace = 3;
  TriangleMesh best = collapsed(thinned, faces, context);
  if (faces > kMostFacesToFit) return best;
  std::size_t fewest = self_intersecting_faces(best).size();
  std::size_t thin_to = thinned.faces.size();
  for (int i = 0; i < kAttempts && fewest > 0 && thin_to > kLeastPerFace * faces; ++i) {
    thin_to = thin_to * 2 / 3;
    TriangleMesh other = collapsed(fast_collapse(thinned, thin_to, context), faces, context);
    const std::size_t meeting = self_intersecting_faces(other).size();
    if (meeting >= fewest || other.faces.size() > best.faces.size()) continue;
    fewest = meeting;
    best = std::move(other);
  }
  return best;
}

}  // namespace

TriangleMesh fitted_proxy(const TriangleMesh& surface, const FittedOptions& options,
                          const RunContext& context) {
  if (surface.faces.size() <= options.faces) return surface;
  const UnitFrame frame(surface);
  const TriangleMesh local = frame.into(surface);
  const TriangleMesh thinned = thin(local, kFewestToFit, options.faces, context),
                     few = thin(thinned, kFewestToBegin, options.faces, context);
  TriangleMesh proxy = start_of(few, options.faces, context);
  if (proxy.faces.size() > kMostFacesToFit) return frame.back(std::move(proxy));

  const FitReference reference(local, thinned,
                               std::max(kFewestSamples, kSamplesPerFace * options.faces));
  fit(proxy, reference, {}, context);
  const bool flips = options.flips && proxy.faces.size() <= kMostFacesToFlip;
  if (flips) {
    improve_faces(proxy, reference, {}, kTrialStride, context);
  }
  if (options.largest) {
    const std::size_t denser = (options.thorough ? kDenser : 2) * reference.samples().size();
    lower_the_largest(proxy, FitReference(local, thinned, denser), flips, options.thorough,
                      context);
  }
  return frame.back(std::move(proxy));
}

}  // namespace organbake
