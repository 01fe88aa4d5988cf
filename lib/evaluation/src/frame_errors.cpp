// SPDX-License-Identifier: Apache-2.0
// How far a picture is from the truth, in pixels: where original vertices, or the skin that pixels
// show, land (the paper's 3.2); and in colours: what steps at the proxy's edges, or when another
// set of cameras takes over, that the truth does not have.
#include "organbake/evaluation/comparison_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/smooth_step.h"
#include "organbake/geometry/refine.h"
#include "organbake/warp/draw_options.h"

namespace organbake {
namespace {

Eigen::Vector3d on_face(const TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& positions,
                        std::uint32_t face, const Eigen::Vector3d& weights) {
  const auto [a, b, c] = mesh.faces[face];
  return weights[0] * positions[a] + weights[1] * positions[b] + weights[2] * positions[c];
}

constexpr double kNotMeasured = -1;

PixelErrors summarise(std::vector<double> errors) {
  std::erase(errors, kNotMeasured);
  PixelErrors result;
  result.vertices = errors.size();
  if (errors.empty()) return result;
  result.mean_px = std::accumulate(errors.begin(), errors.end(), 0.0) / errors.size();
  result.nearly_all_px = quantile(errors, 0.999);
  result.max_px = *std::max_element(errors.begin(), errors.end());
  return result;
}

}  // namespace

ProjectionComparison::ProjectionComparison(const Bundle& bundle, const CarriedSurface& truth)
    : bundle_(bundle),
      truth_(truth),
      shell_(bundle.shell()),
      binder_(shell_.at_rest(), shell_.reach_mm()),
      closest_(truth.at_rest().vertices.size()) {
  parallel_for(std::size_t{0}, closest_.size(),
               [&](std::size_t v) { closest_[v] = closest_to(truth.at_rest().vertices[v]); });
}

// Of all faces; of a skin's many, on the one that the point is bound to.
ProjectionComparison::OnFace ProjectionComparison::closest_to(const Eigen::Vector3d& p) const {
  const TriangleMesh& mesh = shell_.at_rest();
  const auto on = [&](std::uint32_t f) {
    const auto [a, b, c] = mesh.faces[f];
    return OnFace{f, nearest_on_triangle(p, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c])};
  };
  if (shell_.skin()) return on(binder_.bind(p).face);
  OnFace closest;
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const OnFace found = on(f);
    const double d2 = (on_face(mesh, mesh.vertices, f, found.weights) - p).squaredNorm();
    if (d2 < best) best = d2, closest = found;
  }
  return closest;
}

namespace {

// That a map has of skin by its tilt, all up to 60° and none from 80° on, for the piece that is put
// between four texels; slope: texels of depth to one across. Over a riser narrower than a texel
// that piece is steep, be the texels on both its sides as sure as they are.
double confidence_of_slope(double slope) {
  constexpr double kDarkCosine = 0.174, kSureCosine = 0.5;
  return smooth_step(kDarkCosine, kSureCosine, 1 / std::hypot(1, slope));
}

}  // namespace

bool ProjectionComparison::look_up(std::size_t vertex, std::size_t camera, Found& found) const {
  const PosedCamera& c = bundle_.cameras.cameras[camera];
  const CameraMaps& maps = bundle_.maps[camera];
  const Eigen::Vector3d in_camera = c.camera_from_world * truth_.at_rest().vertices[vertex];
  if (in_camera.z() <= 0) return false;
  const Eigen::Vector2d pixel = project(c.intrinsics, in_camera);
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 0 && v >= 0 && u < maps.width - 1 && v < maps.height - 1)) return false;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  // 1/z is linear over a plane's picture, so planes are found exactly.
  std::array<double, 4> inverses{};
  double inverse = 0, nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  found.confidence = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int dx = corner & 1, dy = corner >> 1;
    const std::size_t i = std::size_t(y + dy) * maps.width + (x + dx);
    // What the player does not draw from this camera, it does not see.
    if (maps.face[i] == kNoFace || maps.confidence[i] < kLeastConfidence) return false;
    const double z = maps.depth_mm[i];
    const double share = (dx ? u - x : 1 - (u - x)) * (dy ? v - y : 1 - (v - y));
    inverses[corner] = 1 / z;
    inverse += share / z;
    found.confidence += share * maps.confidence[i];
    nearest = std::min(nearest, z), farthest = std::max(farthest, z);
  }
  // Texels on both sides of an occluding edge show two places: a slope of 6 (80°) between
  // neighbours is the limit. A vertex that lies behind all four texels is over the camera's
  // horizon, however little.
  const double texel_mm = nearest / c.intrinsics.fx;
  if (farthest - nearest > 6 * texel_mm) return false;
  if (in_camera.z() < nearest - texel_mm || in_camera.z() > farthest + texel_mm) return false;
  const double along = std::lerp(inverses[1] - inverses[0], inverses[3] - inverses[2], v - y),
               down = std::lerp(inverses[2] - inverses[0], inverses[3] - inverses[1], u - x);
  const double slope = std::hypot(along, down) * c.intrinsics.fx / inverse;
  found.confidence = std::min(found.confidence, confidence_of_slope(slope));
  found.world_mm =
      c.camera_from_world.inverse() * Eigen::Vector3d(unproject(c.intrinsics, pixel) / inverse);
  return true;
}

bool ProjectionComparison::look_up(std::size_t vertex, const ViewWeights& shares,
                                   Eigen::Vector3d& world_mm) const {
  double heaviest = 0;
  for (int i = 0; i < 3; ++i) {
    Found found;
    if (shares.weights[i] <= 0 || !look_up(vertex, shares.cameras[i], found)) continue;
    const double weight = shares.weights[i] * found.confidence;
    if (weight > heaviest) heaviest = weight, world_mm = found.world_mm;
  }
  return heaviest > 0;
}

ProjectionErrors ProjectionComparison::measure(const std::vector<Eigen::Vector3d>& proxy_positions,
                                               const View& view) const {
  const std::vector<Eigen::Vector3d> carried = truth_.carry(proxy_positions);
  const std::vector<bool> visible = truth_.visible(carried, view);
  const TriangleMesh deformed = shell_.posed(proxy_positions);
  const std::vector<ShellMatrix> shells = shell_.posed_matrices(proxy_positions);
  const ViewManifold& manifold = bundle_.cameras.manifold;
  const ViewWeights shares =
      view_weights(manifold, view.camera.center_world_mm() - manifold.center_world_mm);

  const std::size_t count = carried.size();
  std::vector<double> image_based(count, kNotMeasured), polygons(count, kNotMeasured);
  parallel_for(std::size_t{0}, count, [&](std::size_t v) {
    if (!visible[v]) return;
    const Eigen::Vector2d expected = project(view.camera, carried[v]);
    const auto error = [&](const Eigen::Vector3d& p) {
      return (project(view.camera, p) - expected).norm();
    };
    polygons[v] =
        error(on_face(deformed, deformed.vertices, closest_[v].face, closest_[v].weights));
    Eigen::Vector3d at_rest;
    if (!look_up(v, shares, at_rest)) return;
    const ShellBinding b = binder_.bind(at_rest);
    image_based[v] = error(shell_point(shells[b.face], b.b1, b.b2, b.height_mm));
  });

  ProjectionErrors result;
  result.visible = std::count(visible.begin(), visible.end(), true);
  result.image_based = summarise(std::move(image_based));
  result.polygons = summarise(std::move(polygons));
  result.without_map = result.visible - result.image_based.vertices;
  return result;
}

PixelErrors ProjectionComparison::displayed(const Frame& frame,
                                            const std::vector<Eigen::Vector3d>& proxy_positions,
                                            const View& view) const {
  const std::vector<ShellMatrix> shells = shell_.posed_matrices(proxy_positions);
  std::vector<double> errors(frame.bound.size(), kNotMeasured);
  parallel_for(std::size_t{0}, errors.size(), [&](std::size_t i) {
    const BoundPixel& b = frame.bound[i];
    if (frame.cover[i] != Cover::samples || !b.has_skin()) return;
    const Eigen::Vector3d p = shell_point(shells[b.face], b.b1, b.b2, b.height_mm);
    const Eigen::Vector2d center(static_cast<double>(i % frame.color.width) + 0.5,
                                 static_cast<double>(i / frame.color.width) + 0.5);
    errors[i] = (project(view.camera, p) - center).norm();
  });
  return summarise(std::move(errors));
}

namespace {

using Sum = std::array<double, 3>;

// Summed over pairs of pixels across one place.
struct ColorStep {
  Sum frame{}, truth{};
  std::size_t pairs = 0;
};

void add_difference(const std::uint8_t* a, const std::uint8_t* b, Sum& sum) {
  for (int c = 0; c < 3; ++c) sum[c] += double(b[c]) - double(a[c]);
}

void count_step(const ColorStep& step, SeamSteps& steps) {
  ++steps.places;
  for (int c = 0; c < 3; ++c) {
    const double frame = std::abs(step.frame[c]) / step.pairs,
                 truth = std::abs(step.truth[c]) / step.pairs;
    steps.frame = std::max(steps.frame, frame);
    steps.truth = std::max(steps.truth, truth);
    steps.excess = std::max(steps.excess, frame - truth);
  }
}

}  // namespace

SeamSteps edge_steps(const Rgb8Image& frame, const TruthFrame& truth) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, ColorStep> edges;
  const auto look = [&](int x, int y, int nx, int ny) {
    if (nx >= frame.width || ny >= frame.height) return;
    const std::size_t here = std::size_t(y) * frame.width + x,
                      there = std::size_t(ny) * frame.width + nx;
    std::uint32_t a = truth.shell_face[here], b = truth.shell_face[there];
    // A silhouette's pixel mixes in the background, which no proxy edge has made.
    if (truth.covered[here] < TruthFrame::kRaysPerPixel ||
        truth.covered[there] < TruthFrame::kRaysPerPixel) {
      return;
    }
    if (a == b || a == kNoFace || b == kNoFace) return;
    // From the lower face to the higher, wherever they lie.
    if (a > b) std::swap(a, b), std::swap(x, nx), std::swap(y, ny);
    ColorStep& edge = edges[{a, b}];
    ++edge.pairs;
    add_difference(frame.at(x, y), frame.at(nx, ny), edge.frame);
    add_difference(truth.sharp.at(x, y), truth.sharp.at(nx, ny), edge.truth);
  };
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      look(x, y, x + 1, y);
      look(x, y, x, y + 1);
    }
  }
  // At 35 dB a pixel is off by 4.5 levels, a pair by 6.4, the mean of 40 pairs by 1: half of the
  // two levels that a seam may add. Shorter edges say more of noise than of seams.
  constexpr std::size_t kFewestPairs = 40;
  SeamSteps steps;
  for (const auto& [faces, edge] : edges) {
    if (edge.pairs >= kFewestPairs) count_step(edge, steps);
  }
  return steps;
}

SeamSteps switch_steps(const Rgb8Image& before, const Rgb8Image& after,
                       const TruthFrame& truth_before, const TruthFrame& truth_after) {
  constexpr int kBlock = 8;
  SeamSteps steps;
  for (int y0 = 0; y0 + kBlock <= before.height; y0 += kBlock) {
    for (int x0 = 0; x0 + kBlock <= before.width; x0 += kBlock) {
      ColorStep block;
      for (int y = y0; y < y0 + kBlock; ++y) {
        for (int x = x0; x < x0 + kBlock; ++x) {
          const std::size_t i = std::size_t(y) * before.width + x;
          if (truth_before.covered[i] < TruthFrame::kRaysPerPixel ||
              truth_after.covered[i] < TruthFrame::kRaysPerPixel) {
            continue;
          }
          ++block.pairs;
          add_difference(before.at(x, y), after.at(x, y), block.frame);
          add_difference(truth_before.color.at(x, y), truth_after.color.at(x, y), block.truth);
        }
      }
      if (block.pairs == kBlock * kBlock) count_step(block, steps);
    }
  }
  return steps;
}

}  // namespace organbake
