// SPDX-License-Identifier: Apache-2.0
// The paper's own image warp (2.2, Figure 2), as a baseline. In: a bundle and the deformed proxy.
// Each active camera's microstructure is laid onto the proxy's new depth and warped into the
// picture by squares of pixels; then the nearest surface's views are blended. Out: a frame.
#include "organbake/warp/paper_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "finishing/post_process.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/rasteriser.h"
#include "placing/placing.h"
#include "samples/samples.h"

namespace organbake {
namespace {

constexpr float kFarAway = std::numeric_limits<float>::infinity();
constexpr int kWidestSplat_px = 8;
constexpr double kSpareSplat_px = 0.05;  // a texel of one pixel and a rounding is no two wide
constexpr double kSameSurfaceTexels = 2;

// visit(texel, face, weights) for what of a mesh a camera sees at each of its texels, the nearest
// last; returns its depths.
template <class Visit>
std::vector<float> seen_from(const PosedCamera& camera, const TriangleMesh& mesh,
                             const Visit& visit) {
  constexpr double kNear_mm = 1;
  const Intrinsics& k = camera.intrinsics;
  std::vector<float> depth_mm(std::size_t(k.width) * k.height, kFarAway);
  draw_depths(project_faces(mesh.faces, mesh.vertices, {camera, kNear_mm}),
              {0, 0, k.width, k.height}, depth_mm, visit);
  return depth_mm;
}

// Where a map is looked up: four texels and their shares.
struct Lookup {
  std::array<std::size_t, 4> texel;
  std::array<float, 4> share;

  template <class Value, class At>
  Value mixed(const Value& zero, At&& at) const {
    Value sum = zero;
    for (int i = 0; i < 4; ++i) sum += share[i] * at(texel[i]);
    return sum;
  }
};

// False where any of the four texels lies off the map or has no microstructure.
bool look_up(const CameraMaps& maps, const std::vector<float>& micro, const Eigen::Vector2d& pixel,
             Lookup& out) {
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 0 && v >= 0 && u < maps.width - 1 && v < maps.height - 1)) return false;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const auto along = static_cast<float>(u - x), down = static_cast<float>(v - y);
  for (int i = 0; i < 4; ++i) {
    const int dx = i & 1, dy = i >> 1;
    out.texel[i] = std::size_t(y + dy) * maps.width + x + dx;
    out.share[i] = (dx ? along : 1 - along) * (dy ? down : 1 - down);
    if (!(micro[out.texel[i]] < kFarAway)) return false;
  }
  return true;
}

}  // namespace

// One camera's view of the deformed organ, warped into the picture.
struct PaperWarp::Warped {
  float share = 0;              // of its camera, in the view
  std::vector<float> depth_mm;  // +inf where nothing placed
  std::vector<Eigen::Vector3f> color;
  std::size_t drawn = 0;  // texels

  // A square of whole pixels round the place, where it is the nearest.
  void splat(const Eigen::Vector2d& place, double texel_px, float depth,
             const Eigen::Vector3f& light, const Intrinsics& k) {
    const double side =
        std::clamp(std::ceil(texel_px - kSpareSplat_px), 1.0, double(kWidestSplat_px));
    if (!(place.x() > -side && place.y() > -side && place.x() < k.width + side &&
          place.y() < k.height + side))
      return;
    ++drawn;
    const int x0 = static_cast<int>(std::floor(place.x() - side / 2 + 0.5));
    const int y0 = static_cast<int>(std::floor(place.y() - side / 2 + 0.5));
    const int n = static_cast<int>(side);
    const PixelBox box = intersected({x0, y0, x0 + n, y0 + n}, {0, 0, k.width, k.height});
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        const std::size_t to = std::size_t(y) * k.width + x;
        if (!(depth < depth_mm[to])) continue;
        depth_mm[to] = depth;
        color[to] = light;
      }
    }
  }
};

// Combines the views of one pixel: those on the nearest surface, by their shares, in linear light.
// Returns its depth.
float PaperWarp::blend(const std::vector<Warped>& views, std::size_t pixel, double same_surface,
                       const DrawOptions& options, Frame& frame) {
  float nearest = kFarAway;
  for (const Warped& view : views) nearest = std::min(nearest, view.depth_mm[pixel]);
  const bool shown = nearest < kFarAway;
  std::uint8_t* const rgb = &frame.color.pixels[3 * pixel];
  frame.cover[pixel] = shown ? Cover::samples : Cover::background;
  if (!shown) {
    std::copy(options.background.begin(), options.background.end(), rgb);
    return nearest;
  }
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float weight = 0;
  const auto behind = static_cast<float>((1 + same_surface) * nearest);
  for (const Warped& view : views) {
    if (view.depth_mm[pixel] > behind) continue;
    sum += view.share * view.color[pixel];
    weight += view.share;
  }
  for (int channel = 0; channel < 3; ++channel)
    rgb[channel] = srgb8_from_linear(sum[channel] / weight);
  return nearest;
}

PaperWarp::PaperWarp(const Bundle& bundle)
    : bundle_(bundle), shell_(bundle.shell()), micro_depth_(bundle.maps.size()) {
  if (bundle.maps.empty() || bundle.maps.size() != bundle.cameras.cameras.size()) {
    throw UsageError("the paper's warp needs the cameras' maps; load the player with them kept");
  }
  parallel_for(std::size_t{0}, bundle.maps.size(), [&](std::size_t c) {
    const CameraMaps& maps = bundle.maps[c];
    const std::vector<float> proxy = seen_from(bundle.cameras.cameras[c], shell_.at_rest(),
                                               [](std::size_t, std::uint32_t, const auto&) {});
    std::vector<float>& micro = micro_depth_[c];
    micro.resize(proxy.size());
    for (std::size_t i = 0; i < micro.size(); ++i) {
      const bool both = proxy[i] < kFarAway && maps.face[i] != kNoFace;
      micro[i] = both ? maps.depth_mm[i] - proxy[i] : kFarAway;
    }
  });
}

PaperWarp::Warped PaperWarp::warp(std::size_t number, const TriangleMesh& deformed,
                                  const View& view) const {
  const PosedCamera& camera = bundle_.cameras.cameras[number];
  const CameraMaps& maps = bundle_.maps[number];
  // The macrostructure: the deformed proxy's depth, and which skin each pixel shows.
  std::vector<Eigen::Vector2d> rest_pixel(maps.depth_mm.size());
  std::vector<float> rest_depth(rest_pixel.size());
  const std::vector<float> macro = seen_from(
      camera, deformed, [&](std::size_t i, std::uint32_t f, const std::array<double, 3>& w) {
        const auto [a, b, c] = shell_.at_rest().faces[f];
        const auto& at = shell_.at_rest().vertices;
        const Eigen::Vector3d on_face = w[0] * at[a] + w[1] * at[b] + w[2] * at[c];
        const Eigen::Vector3d rest = camera.camera_from_world * on_face;
        rest_pixel[i] = project(camera.intrinsics, rest);
        rest_depth[i] = static_cast<float>(rest.z());
      });
  const RigidTransform view_from_camera =
      view.camera.camera_from_world * camera.camera_from_world.inverse();
  const Intrinsics& k = view.camera.intrinsics;
  const std::size_t pixels = std::size_t(k.width) * k.height;
  Warped out{.depth_mm = std::vector<float>(pixels, kFarAway),
             .color = std::vector<Eigen::Vector3f>(pixels)};
  for (std::size_t i = 0; i < macro.size(); ++i) {
    Lookup at;
    if (!(macro[i] < kFarAway) || !look_up(maps, micro_depth_[number], rest_pixel[i], at)) continue;
    // Skin that another part of the proxy hid at rest was never seen from here.
    const float texel_mm = rest_depth[i] / static_cast<float>(camera.intrinsics.fx);
    const float seen_mm = maps.depth_mm[at.texel[0]] - micro_depth_[number][at.texel[0]];
    if (rest_depth[i] > seen_mm + 6 * texel_mm) continue;
    const float z =
        macro[i] + at.mixed(0.0f, [&](std::size_t t) { return micro_depth_[number][t]; });
    const Eigen::Vector2d pixel(double(i % maps.width) + 0.5, double(i / maps.width) + 0.5);
    const Eigen::Vector3d p =
        view_from_camera * Eigen::Vector3d(double(z) * unproject(camera.intrinsics, pixel));
    if (p.z() < view.near_mm) continue;
    const Eigen::Vector2d placed = project(k, p);
    const Eigen::Vector3f color = at.mixed(Eigen::Vector3f(Eigen::Vector3f::Zero()),
                                           [&](std::size_t t) { return maps.color[t]; });
    const double texel_px = k.fx / p.z() * z / camera.intrinsics.fx;
    out.splat(placed, texel_px, static_cast<float>(p.z()), color, k);
  }
  return out;
}

DrawReport PaperWarp::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                           const DrawOptions& options, Frame& frame) const {
  view.check();
  check_positions(positions, shell_.proxy());
  if (options.keep_bound)
    throw UsageError("the paper's own warp does not tell what skin each pixel shows");
  DrawReport report;
  report.weights = drawn_shares(bundle_.cameras.manifold, view);
  const TriangleMesh deformed = shell_.posed(positions);
  const std::vector<std::size_t> cameras = used_cameras(report.weights);
  const int width = view.camera.intrinsics.width, height = view.camera.intrinsics.height;
  std::vector<Warped> views(cameras.size());
  parallel_for(std::size_t{0}, cameras.size(),
               [&](std::size_t c) { views[c] = warp(cameras[c], deformed, view); });
  auto used = views.begin();
  for (const double weight : report.weights.weights)
    if (weight > 0) (used++)->share = static_cast<float>(weight);
  for (const Warped& warped : views) report.samples_drawn += warped.drawn;

  frame.resize(width, height, options.needs_depth(), false);
  const double same_surface =
      kSameSurfaceTexels / bundle_.cameras.cameras[cameras[0]].intrinsics.fx;
  std::vector<float> depth_mm(frame.cover.size());
  for (std::size_t i = 0; i < depth_mm.size(); ++i) {
    depth_mm[i] = blend(views, i, same_surface, options, frame);
    report.sample_pixels += depth_mm[i] < kFarAway;
  }
  if (options.needs_depth()) frame.depth_mm = depth_mm;
  const SkinDepth depth = SkinDepth::of(depth_mm, width, 1);
  const double distance_mm = (bundle_.cameras.cameras[cameras[0]].center_world_mm() -
                              bundle_.cameras.manifold.center_world_mm)
                                 .norm();
  const auto deeper_mm =
      static_cast<float>(kStepTexels / kSameSurfaceTexels * same_surface * distance_mm);
  PostProcess(Lighting())
      .apply(view, options, {0, 0, width, height}, depth, deeper_mm, frame, report);
  return report;
}

DrawReport PaperWarp::draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                           const DrawOptions& options, Frame& frame) {
  if (organs.size() > 1) throw UsageError("the paper's own warp draws one organ alone");
  const std::vector<Eigen::Vector3d>& positions = organs.front().positions_mm;
  if (positions.size() != bundle_.proxy.vertices.size())
    throw UsageError("the paper's own warp draws no cuts");
  return draw(positions, view, options, frame);
}

}  // namespace organbake
