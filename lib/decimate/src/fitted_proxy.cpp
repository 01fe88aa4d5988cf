// SPDX-License-Identifier: GPL-3.0-or-later
// The fitted proxy, from coarse to fine decisions: a fast pre-pass, Lindstrom & Turk's collapses
// (1998), vertices by least squares, then flips and relocations of single vertices. For the largest
// distance the same with rising powers of the distances, which near the maximum step by step; it
// has no slope to follow.
#include "fitted_proxy.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "fit_reference.h"
#include "organbake/decimate/collapse.h"
#include "organbake/decimate/fast_collapse.h"
#include "organbake/decimate/mesh_defects.h"
#include "proxy_moves.h"
#include "refined_proxy.h"
#include "unfold_faces.h"
#include "unit_frame.h"
#include "vertex_fit.h"

namespace organbake {
namespace {

// The pre-pass leaves so many faces that fitting to them is as good as to all, and goes on to so
// many that Lindstrom–Turk's answer, once fitted, is as good as from all.
constexpr std::size_t kFewestToFit = 8'000, kFewestToBegin = 2'500, kThinnedPerFace = 8;
// Samples a side: many a face, so that no face fits the noise between its samples.
constexpr std::size_t kFewestSamples = 5'500, kSamplesPerFace = 16;
constexpr std::size_t kTrialStride = 2;  // trials of local changes make do with every second
// The largest distance hides between samples: it takes more of them.
constexpr std::size_t kDenser = 4;

// Says in the log, and nowhere else, what took how long.
class StepTimes {
 public:
  explicit StepTimes(const RunContext& context) : context_(context) {}
  void done(const std::string& what, std::size_t faces) {
    const auto now = std::chrono::steady_clock::now();
    const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(now - last_);
    context_.debug(what + ": " + std::to_string(faces) + " faces, " +
                   std::to_string(passed.count()) + " ms");
    last_ = now;
  }

 private:
  const RunContext& context_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

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
  StepTimes times(context);
  const UnitFrame frame(surface);
  const TriangleMesh local = frame.into(surface);
  const TriangleMesh thinned = thin(local, kFewestToFit, options.faces, context),
                     few = thin(thinned, kFewestToBegin, options.faces, context);
  times.done("pre-pass", few.faces.size());
  TriangleMesh proxy = start_of(few, options.faces, context);
  times.done("Lindstrom–Turk", proxy.faces.size());
  if (proxy.faces.size() > kMostFacesToFit) return frame.back(std::move(proxy));

  const FitReference reference(local, thinned,
                               std::max(kFewestSamples, kSamplesPerFace * options.faces));
  fit(proxy, reference, {}, context);
  times.done("fit", proxy.faces.size());
  const bool flips = options.flips && proxy.faces.size() <= kMostFacesToFlip;
  if (flips) {
    improve_faces(proxy, reference, {}, kTrialStride, context);
    times.done("flips", proxy.faces.size());
  }
  if (options.largest) {
    const std::size_t denser = (options.thorough ? kDenser : 2) * reference.samples().size();
    lower_the_largest(proxy, FitReference(local, thinned, denser), flips, options.thorough,
                      context);
    times.done("largest distance", proxy.faces.size());
  }
  return frame.back(std::move(proxy));
}

}  // namespace organbake
