// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "drawing/near_clip.h"
#include "organbake/core/random.h"
#include "organbake/warp/warper.h"
#include "placing/chunk_frame.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Vector3d any_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), turn = random.uniform(0, 2 * std::numbers::pi);
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

// An eye between 1 and 60 mm off the skin, as many near as far, that looks at it from above or
// along it.
View near_view(const SyntheticOrgan& organ, RandomStream& random, double& away_mm) {
  const Vector3d out = any_direction(random);
  const Vector3d skin = organ.center + organ.radius(out) * out;
  away_mm = std::pow(60, random.uniform(0, 1));
  const Vector3d eye = skin + away_mm * out;
  const double slant = random.uniform(0, 85) * std::numbers::pi / 180;
  const Vector3d aside = out.unitOrthogonal().cross(out).normalized();
  View view;
  view.camera.camera_from_world =
      look_at(eye, eye - std::cos(slant) * out + std::sin(slant) * aside, out);
  view.camera.intrinsics = {160, 120, 130, 130, 80, 60};
  return view;
}

struct Wrong {
  int inside = 0, background = 0, far_side = 0;
};

// Pixels well inside the organ's outline, by its formula, and what is wrong there.
Wrong wrong_pixels(const SyntheticOrgan& organ, const View& view, const Frame& frame) {
  const RigidTransform world_from_camera = view.camera.camera_from_world.inverse();
  const Vector3d eye = view.camera.center_world_mm();
  const Intrinsics& k = view.camera.intrinsics;
  const auto depth_at = [&](int x, int y) {
    const Vector3d ray((x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1);
    return organ.trace(eye, world_from_camera.rotation * ray);
  };
  constexpr int kRim =
      3;  // pixels; the outline of the player's skin is the formula's to about 1 mm
  Wrong wrong;
  for (int y = kRim; y + kRim < k.height; y += 3) {
    for (int x = kRim; x + kRim < k.width; x += 3) {
      const double depth = depth_at(x, y);
      bool inside = std::isfinite(depth) && depth > 2 * view.near_mm;
      for (const int off : {-kRim, kRim})
        inside =
            inside && std::isfinite(depth_at(x + off, y)) && std::isfinite(depth_at(x, y + off));
      if (!inside) continue;
      ++wrong.inside;
      const std::size_t at = std::size_t(y) * k.width + x;
      wrong.background += frame.cover[at] == Cover::background;
      wrong.far_side += frame.cover[at] != Cover::background && frame.depth_mm[at] > 2 * depth + 20;
    }
  }
  return wrong;
}

TEST(NearViews, ShowSkinWhereverTheOrganIs) {
  SyntheticOptions options;
  options.organ.lump_share = 0.05;
  const Bundle bundle = make_synthetic_bundle(options);
  Warper warper(bundle);
  DrawOptions with_depth;
  with_depth.keep_depth = true;
  Wrong all;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    RandomStream random(seed);
    double away_mm = 0;
    const View view = near_view(options.organ, random, away_mm);
    Frame frame;
    warper.draw(bundle.proxy.vertices, view, with_depth, frame);
    const Wrong wrong = wrong_pixels(options.organ, view, frame);
    if (wrong.background + wrong.far_side > 0)
      std::printf("seed %d, %.1f mm off: of %d pixels %d show background, %d the far side\n",
                  static_cast<int>(seed), away_mm, wrong.inside, wrong.background, wrong.far_side);
    all.inside += wrong.inside;
    all.background += wrong.background, all.far_side += wrong.far_side;
  }
  EXPECT_GT(all.inside, 200000);
  EXPECT_EQ(all.background, 0);
  EXPECT_EQ(all.far_side, 0);
}

// Pixels farther than a quarter of the picture from where a point is seen that differ.
int differ_away_from(const Vector3d& point, const View& view, const Frame& a, const Frame& b) {
  const Vector3d at = view.camera.camera_from_world * point;
  const Intrinsics& k = view.camera.intrinsics;
  const double x = k.fx * at.x() / at.z() + k.cx, y = k.fy * at.y() / at.z() + k.cy;
  int differ = 0;
  for (int i = 0; i < k.width * k.height; ++i) {
    const double away = std::hypot(i % k.width + 0.5 - x, i / k.width + 0.5 - y);
    const auto pixel = a.color.pixels.begin() + 3 * i;
    differ += away > 0.25 * k.width && !std::equal(pixel, pixel + 3, &b.color.pixels[3 * i]);
  }
  return differ;
}

// However near a poke brings its skin, elsewhere nothing is drawn in another way: not when texels
// become so large that they would be seen as such, and not when the base layer is drawn beneath.
TEST(NearViews, APokeThatComesNearChangesNothingElsewhere) {
  SyntheticOptions options;
  options.base_step_mm = 2;
  options.proxy_subdivisions = 3;
  Bundle bundle = make_synthetic_bundle(options);
  bundle.lighting.emplace();
  bundle.lighting->scope = ScopeLight{{6, -4, 1}, 150, 0.5, 0.9};
  View view{bundle.cameras.cameras[0], 1};
  const Vector3d eye = view.camera.center_world_mm();
  std::vector<Vector3d> near = bundle.proxy.vertices;
  Vector3d& nearest = *std::min_element(
      near.begin(), near.end(),
      [&](const auto& a, const auto& b) { return (a - eye).norm() < (b - eye).norm(); });
  nearest += 0.2 * (eye - nearest);
  const Intrinsics lens = view.camera.intrinsics;
  DrawOptions by_scope;
  by_scope.light = DrawnLight::scope;
  // Zooms at which the poke's largest texel comes to cover three pixels, and kNearSplat.
  for (const auto& [zoom, least_px] :
       {std::pair(1.925, 3.0), std::pair(10.3, double(kNearSplat))}) {
    Intrinsics& k = view.camera.intrinsics = lens;
    k.width = int(zoom * k.width), k.height = int(zoom * k.height);
    k.fx *= zoom, k.fy *= zoom, k.cx *= zoom, k.cy *= zoom;
    Warper warper(bundle);
    Frame before, after, fresh;
    EXPECT_LT(warper.draw(bundle.proxy.vertices, view, by_scope, before).largest_stretch_px,
              least_px);
    after = before;
    EXPECT_GE(warper.draw(near, view, by_scope, after).largest_stretch_px, least_px);
    EXPECT_EQ(differ_away_from(nearest, view, before, after), 0);
    Warper(bundle).draw(near, view, by_scope, fresh);
    EXPECT_EQ(after.color.pixels, fresh.color.pixels);
  }
}

TEST(ClippedTriangle, KeepsWhatLiesBehindTheNearPlane) {
  const std::array<Eigen::Vector3f, 3> triangle = {
      Eigen::Vector3f(0, 0, -1), Eigen::Vector3f(4, 0, 3), Eigen::Vector3f(0, 8, 7)};
  const ClippedTriangle clipped(triangle, 1);
  ASSERT_EQ(clipped.count, 4);
  for (int k = 0; k < clipped.count; ++k) {
    const ClippedCorner& corner = clipped.corners[k];
    Eigen::Vector3f again = Eigen::Vector3f::Zero();
    for (int i = 0; i < 3; ++i) again += corner.shares[i] * triangle[i];
    EXPECT_LT((again - corner.at).norm(), 1e-5f);
    EXPECT_GE(corner.at.z(), 1);
  }
  EXPECT_EQ(ClippedTriangle(triangle, 8).count, 0);
  EXPECT_EQ(ClippedTriangle(triangle, -2).count, 3);
}

}  // namespace
}  // namespace organbake
