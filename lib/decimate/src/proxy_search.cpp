// SPDX-License-Identifier: GPL-3.0-or-later
// A proxy that serves everywhere: off nowhere by more than a share of the thickness there. In: a
// manifold surface, a first proxy and the meter of both; out: the nearest proxy of those tried, as
// measured. Where few places are off, vertices are added there, each fitted with its neighbours;
// where it is too coarse as a whole, more faces are asked of the method, as many as the error of a
// smooth surface says, which goes with 1 / faces.
#include "proxies.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

#include "organbake/decimate/decimate.h"

namespace organbake {

TriangleMesh proxy_with_faces(const TriangleMesh& surface, const DecimateOptions& options,
                              std::size_t faces, const RunContext& context) {
  if (options.method == DecimateMethod::lindstrom_turk)
    return collapse_edges(surface, faces, context);
  if (options.method == DecimateMethod::quadric)
    return collapse_by_quadrics(surface, faces, context);
  // A search asks a dozen times: there, what costs most for the least is left out, and the largest
  // distance is what it is about.
  const bool searching = options.max_share > 0;
  return fitted_proxy(surface,
                      {.faces = faces,
                       .flips = options.flips && !searching,
                       .largest = searching,
                       .thorough = !searching},
                      context);
}

namespace {

constexpr double kClose = 0.95;  // of the limit: where vertices are added
constexpr double kPower = 4;     // of the distances that a new vertex's patch is fitted to
constexpr std::size_t kFewestFitSamples = 5'500, kFitSamplesPerFace = 16;

// The weights of a point on a triangle's plane.
Eigen::Vector3d weights_of(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  Eigen::Matrix<double, 3, 2> sides;
  sides << b - a, c - a;
  const Eigen::Vector2d w =
      (sides.transpose() * sides + 1e-12 * sides.squaredNorm() * Eigen::Matrix2d::Identity())
          .ldlt()
          .solve(sides.transpose() * (p - a));
  return {1 - w[0] - w[1], w[0], w[1]};
}

// Adds one vertex to the face, at its far point: within it, or on the edge that is near. False when
// no good faces come of it.
bool add_vertex(RefinedProxy& refined, std::uint32_t face, const TriangleMesh& proxy,
                const FarPoint& far, std::vector<char>& touched) {
  constexpr double kNearEdge = 0.25;
  const Face& f = proxy.faces[face];
  const Eigen::Vector3d w =
      weights_of(far.on_proxy, proxy.vertices[f[0]], proxy.vertices[f[1]], proxy.vertices[f[2]]);
  int corner = 0;
  const double least = w.minCoeff(&corner);
  std::vector<ProxyMove> moves;
  const auto split = [&](int c, bool at_point) {
    auto move = refined.split(f[(c + 1) % 3], f[(c + 2) % 3]);
    if (!move) return;
    if (at_point) move->inserted = {far.on_surface};
    moves.push_back(std::move(*move));
  };
  if (least >= kNearEdge) moves.push_back(refined.insert(face, far.on_surface));
  split(corner, true);
  for (int c = 0; c < 3; ++c) split((corner + c) % 3, false);
  for (const ProxyMove& move : moves) {
    // Whatever it costs the energy, which is a mean: the place that is off farthest is what counts.
    const auto trial = refined.attempt(move, std::numeric_limits<double>::lowest());
    if (!trial || std::any_of(trial->old_faces.begin(), trial->old_faces.end(),
                              [&](auto old) { return old < touched.size() && touched[old]; }))
      continue;
    if (!refined.make(*trial)) continue;
    for (const std::uint32_t old : trial->old_faces)
      if (old < touched.size()) touched[old] = 1;
    return true;
  }
  return false;
}

// One round: a vertex for each face that lies too far off, the farthest first, as long as they do
// not stand in each other's way. Returns how many.
std::size_t add_vertices(TriangleMesh& proxy, const FitReference& reference, const UnitFrame& frame,
                         std::vector<FarPoint> far, double share, std::size_t most_faces,
                         const RunContext& context) {
  for (FarPoint& point : far) {
    point.on_surface = frame.into(point.on_surface);
    point.on_proxy = frame.into(point.on_proxy);
  }
  std::vector<std::uint32_t> order(far.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return far[a].share > far[b].share; });
  TriangleMesh local = frame.into(proxy);
  double largest = 0;
  for (const FarPoint& point : far)
    largest = std::max(largest, (point.on_surface - point.on_proxy).norm());
  RefinedProxy refined(local, reference, {.power = kPower, .scale = std::max(largest, 1e-9)}, true);
  std::vector<char> touched(far.size(), 0);
  std::size_t added = 0;
  for (const std::uint32_t face : order) {
    context.throw_if_cancelled();
    if (far[face].share <= share || refined.face_count() + 2 > most_faces) break;
    if (!touched[face] && add_vertex(refined, face, local, far[face], touched)) ++added;
  }
  proxy = frame.back(refined.mesh());
  return added;
}

// A few rounds of added vertices, as long as they help.
void refine(MeasuredProxy& found, const TriangleMesh& surface, const RegionMeter& meter,
            const DecimateOptions& options, const RunContext& context) {
  constexpr int kMostRounds = 3;
  const UnitFrame frame(surface);
  const TriangleMesh local = frame.into(surface);
  for (int round = 0; round < kMostRounds && found.errors.worst_share > options.max_share;
       ++round) {
    TriangleMesh next = found.mesh;
    const FitReference reference(
        local, local, std::max(kFewestFitSamples, kFitSamplesPerFace * next.faces.size()));
    const std::size_t added = add_vertices(next, reference, frame, meter.far_points(next, context),
                                           kClose * options.max_share, options.most_faces, context);
    if (added == 0) return;
    const RegionErrors errors = meter.measure(next, context);
    context.debug("serving: " + std::to_string(added) + " vertices more, off by " +
                  std::to_string(errors.worst_share) + " of the thickness");
    if (errors.worst_share >= found.errors.worst_share) return;
    found = {std::move(next), errors};
  }
}

}  // namespace

MeasuredProxy serving_proxy(const TriangleMesh& surface, TriangleMesh first,
                            const RegionMeter& meter, const DecimateOptions& options,
                            const RunContext& context) {
  // Where more is missing, all of the proxy is too coarse, not a few places.
  constexpr double kFewPlaces = 2;
  // The error of a smooth surface goes with 1 / faces; that of a tube may fall at once.
  constexpr double kLeastMore = 1.25, kMostMore = 3;
  const std::size_t most = std::min(options.most_faces, surface.faces.size());
  std::size_t faces = std::min(options.faces, most);
  std::optional<MeasuredProxy> best;
  while (true) {
    MeasuredProxy tried{best ? proxy_with_faces(surface, options, faces, context)
                             : std::move(first)};
    tried.errors = meter.measure(tried.mesh, context);
    const double share = tried.errors.worst_share;
    context.debug("serving: " + std::to_string(tried.mesh.faces.size()) + " faces, off by " +
                  std::to_string(share) + " of the thickness");
    // What is off in a few places is mended there; what is off all over is made anew, with more.
    if (share <= kFewPlaces * options.max_share) refine(tried, surface, meter, options, context);
    // More faces lie elsewhere, so that a finer proxy may be off by more than the one before.
    if (!best || tried.errors.worst_share < best->errors.worst_share) best = std::move(tried);
    if (best->errors.worst_share <= options.max_share || faces >= most) return std::move(*best);
    const double more = std::clamp(share / options.max_share, kLeastMore, kMostMore);
    faces = std::min(most, static_cast<std::size_t>(more * double(faces)) & ~std::size_t{1});
  }
}

}  // namespace organbake
