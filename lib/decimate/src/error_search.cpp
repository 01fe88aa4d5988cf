// SPDX-License-Identifier: GPL-3.0-or-later
// The fewest faces that keep an error budget. The error hardly ever falls steadily with the count,
// so a bracket is narrowed by guesses (the error of a smooth surface goes with 1 / faces) and what
// is returned has been measured.
#include "error_search.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "fitted_proxy.h"
#include "organbake/decimate/collapse.h"
#include "organbake/decimate/mesh_distance.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

// Verified distances to one surface, its search tree built once.
class Verifier {
 public:
  Verifier(const TriangleMesh& surface, const RunContext& context)
      : surface_(surface), scene_(surface), context_(context) {}

  double distance(const TriangleMesh& proxy) const {
    return std::max(largest_distance(proxy, surface_, scene_, context_),
                    largest_distance(surface_, proxy, RayScene(proxy), context_));
  }

 private:
  const TriangleMesh& surface_;
  RayScene scene_;
  const RunContext& context_;
};

}  // namespace

TriangleMesh proxy_with_faces(const TriangleMesh& surface, const DecimateOptions& options,
                              std::size_t faces, const RunContext& context) {
  switch (options.method) {
    case DecimateMethod::lindstrom_turk:
      return collapse_edges(surface, faces, context);
    case DecimateMethod::quadric:
      return collapse_by_quadrics(surface, faces, context);
    default: {
      // A search asks a dozen times: there, what costs most for the least is left out.
      const bool searching = options.max_error_mm > 0 || options.max_share > 0;
      return fitted_proxy(surface,
                          {.faces = faces,
                           .flips = options.flips && !searching,
                           .largest = searching || options.objective == DecimateObjective::max,
                           .thorough = !searching},
                          context);
    }
  }
}

double verified_distance(const TriangleMesh& surface, const TriangleMesh& proxy,
                         const RunContext& context) {
  return Verifier(surface, context).distance(proxy);
}

TriangleMesh fewest_faces(const TriangleMesh& surface, const DecimateOptions& options,
                          const RunContext& context) {
  // The error hardly ever falls steadily with the count, so neighbours are not told apart.
  constexpr double kClose = 1.06;
  const Verifier verifier(surface, context);
  TriangleMesh best = surface;
  std::size_t low = 4, high = surface.faces.size();  // too coarse (as a rule), fine enough
  std::size_t tried = std::clamp<std::size_t>(high / 16, low, 200);
  while (double(high) > kClose * double(low) && high > low + 2) {
    context.throw_if_cancelled();
    TriangleMesh proxy = proxy_with_faces(surface, options, tried, context);
    double error = verifier.distance(proxy);
    if (error > options.max_error_mm && options.method == DecimateMethod::fitted) {
      // At borders and creases the fit, which minds all distances, may lose to its own start.
      TriangleMesh plain = collapse_edges(surface, tried, context);
      const double plain_error = verifier.distance(plain);
      if (plain_error < error) {
        error = plain_error;
        proxy = std::move(plain);
      }
    }
    const bool kept = error <= options.max_error_mm;
    context.debug("max-error: " + std::to_string(proxy.faces.size()) + " faces, " +
                  std::to_string(error) + " mm");
    if (kept) {
      const bool fewer = proxy.faces.size() < best.faces.size();
      high = std::min(tried, proxy.faces.size());
      if (fewer) best = std::move(proxy);
      if (high <= low) break;
    } else {
      low = std::max(tried, std::min(proxy.faces.size(), high - 1));
    }
    // The error of a smooth surface goes with 1 / faces: a guess, kept inside the bracket.
    const double guess = double(tried) * std::clamp(error / options.max_error_mm, 0.25, 4.0);
    const double middle = std::sqrt(double(low) * double(high));
    const double lowest = std::pow(double(low), 0.8) * std::pow(double(high), 0.2);
    const double highest = std::pow(double(low), 0.2) * std::pow(double(high), 0.8);
    const double next = double(high) > 4 * double(low) ? guess : middle;
    tried = std::clamp(static_cast<std::size_t>(std::clamp(next, lowest, highest)), low + 1,
                       std::max(low + 1, high - 1));
  }
  return best;
}

}  // namespace organbake
