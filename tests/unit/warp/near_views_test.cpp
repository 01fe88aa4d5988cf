// SPDX-License-Identifier: GPL-3.0-or-later

#include <cstdio>

#include "drawing/base_drawing.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/warp/view.h"
#include "organbake/warp/warper.h"
#include "placing/placing.h"
#include "support/organs.h"
#include "support/testing.h"
#include "unit/warp/views_round.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Vector3d any_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), turn = random.uniform(0, 2 * std::numbers::pi);
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

// An eye between 0.5 and 100 mm off the skin, as many near as far, that looks at it from above or
// along it.
View near_view(const SyntheticOrgan& organ, RandomStream& random, double& away_mm) {
  const Vector3d out = any_direction(random);
  const Vector3d skin = organ.center + organ.radius(out) * out;
  away_mm = 0.5 * std::pow(200, random.uniform(0, 1));
  const Vector3d eye = skin + away_mm * out;
  const double slant = random.uniform(0, 88) * std::numbers::pi / 180;
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

// Pixels well inside the organ's outline, by its formula, and what is wrong there: those round
// which the skin runs on for as far as the player's may lie beside the formula's.
Wrong wrong_pixels(const SyntheticOrgan& organ, const View& view, const Frame& frame) {
  const RigidTransform world_from_camera = view.camera.camera_from_world.inverse();
  const Vector3d eye = view.camera.center_world_mm();
  const Intrinsics& k = view.camera.intrinsics;
  const auto depth_at = [&](double x, double y) {
    const Vector3d ray((x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1);
    return organ.trace(eye, world_from_camera.rotation * ray);
  };
  constexpr double kSkin_mm = 1, kRim_px = 3;
  constexpr double kBehind_mm = 6, kBehindShare = 0.5;  // along a grazing ray
  Wrong wrong;
  for (int y = 0; y < k.height; y += 3) {
    for (int x = 0; x < k.width; x += 3) {
      const double depth = depth_at(x, y);
      if (!std::isfinite(depth) || depth < 2 * view.near_mm) continue;
      const double behind = depth + kBehind_mm + kBehindShare * depth;
      const double rim = std::max(kRim_px, kSkin_mm * k.fx / depth);
      bool inside = true;
      for (const double off : {-rim, rim})
        inside = inside && depth_at(x + off, y) < behind && depth_at(x, y + off) < behind;
      if (!inside) continue;
      ++wrong.inside;
      const std::size_t at = std::size_t(y) * k.width + x;
      wrong.background += frame.cover[at] == Cover::background;
      wrong.far_side += frame.cover[at] != Cover::background && frame.depth_mm[at] > behind;
    }
  }
  return wrong;
}

// Of a round organ and of a thin lobe, whose other side lies close behind. (All thousand of each
// where ORGANBAKE_THOROUGH is set.)
TEST(NearViews, ShowSkinWhereverTheOrganIs) {
  const std::uint64_t seeds = std::getenv("ORGANBAKE_THOROUGH") ? 1000 : 100;
  SyntheticOptions round, thin;
  round.organ.lump_share = 0.05;
  thin.organ.half_axes_mm = {60, 14, 50};
  thin.proxy_subdivisions = 2;
  for (const SyntheticOptions& options : {round, thin}) {
    const Bundle bundle = make_synthetic_bundle(options);
    Warper warper(bundle);
    DrawOptions with_depth;
    with_depth.keep_depth = true;
    Wrong all;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      RandomStream random(seed);
      double away_mm = 0;
      const View view = near_view(options.organ, random, away_mm);
      Frame frame;
      warper.draw(bundle.proxy.vertices, view, with_depth, frame);
      const Wrong wrong = wrong_pixels(options.organ, view, frame);
      if (wrong.background + wrong.far_side > 0)
        std::printf("seed %d, %.1f mm off: of %d pixels %d show background, %d the far side\n",
                    static_cast<int>(seed), away_mm, wrong.inside, wrong.background,
                    wrong.far_side);
      all.inside += wrong.inside;
      all.background += wrong.background, all.far_side += wrong.far_side;
    }
    EXPECT_GT(all.inside, 300 * static_cast<int>(seeds));
    EXPECT_EQ(all.background, 0);
    EXPECT_EQ(all.far_side, 0);
  }
}

// From within an organ that has no folds all of its skin faces away. Samples of it that were drawn
// from near would hang before whatever lies behind as loose texels.
TEST(NearViews, ShowNoLooseTexelsFromWithin) {
  const SyntheticOptions options;
  const Bundle bundle = make_synthetic_bundle(options);
  Warper warper(bundle);
  const SyntheticOrgan& organ = options.organ;
  DrawOptions with_depth;
  with_depth.keep_depth = true;
  constexpr double kFocal_px = 260;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    RandomStream random(seed);
    const Vector3d out = any_direction(random), ahead = any_direction(random);
    const double deep_mm = random.uniform(3, 25);
    const Vector3d eye = organ.center + (organ.radius(out) - deep_mm) * out;
    View view;
    view.camera.camera_from_world = look_at(eye, eye + ahead, ahead.unitOrthogonal());
    view.camera.intrinsics = {320, 240, kFocal_px, kFocal_px, 160, 120};
    Frame frame;
    const DrawReport report = warper.draw(bundle.proxy.vertices, view, with_depth, frame);
    constexpr double kLoose_px = 24;  // a texel of so many would be seen as one
    const double near_mm = kFocal_px * report.texel_mm / kLoose_px;
    EXPECT_EQ(std::count_if(frame.depth_mm.begin(), frame.depth_mm.end(),
                            [&](float depth) { return depth < near_mm; }),
              0)
        << "seed " << seed << ", " << deep_mm << " mm below the skin";
  }
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

// However near a poke brings its skin, elsewhere nothing is drawn in another way: the base layer is
// drawn beneath the poke alone.
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
  DrawOptions by_scope;
  by_scope.light = DrawnLight::scope;
  Warper warper(bundle);
  Frame before, after, fresh;
  const float texel_mm = warper.draw(bundle.proxy.vertices, view, by_scope, before).texel_mm;
  // So that the poke's texels come to cover kNearTexel_px, and no other's do.
  Intrinsics& k = view.camera.intrinsics;
  const double zoom = 1.1 * kNearTexel_px * (nearest - eye).norm() / (k.fx * texel_mm);
  k.width = int(zoom * k.width), k.height = int(zoom * k.height);
  k.fx *= zoom, k.fy *= zoom, k.cx *= zoom, k.cy *= zoom;
  const DrawReport at_rest = warper.draw(bundle.proxy.vertices, view, by_scope, before);
  after = before;
  warper.draw(near, view, by_scope, after);
  EXPECT_EQ(differ_away_from(nearest, view, before, after), 0);
  const DrawReport poked = Warper(bundle).draw(near, view, by_scope, fresh);
  EXPECT_GT(poked.base_triangles, at_rest.base_triangles);
  EXPECT_EQ(after.color.pixels, fresh.color.pixels);
}

const Bundle& bounds_organ() {
  static const Bundle bundle = make_synthetic_bundle({.organ = {}, .map_size = 64});
  return bundle;
}

View front(int width, int height, double away = 1) {
  return view_round(bounds_organ().cameras, 0.3, 0.2, away, width, height);
}

DrawReport draw(const View& view, Frame& frame) {
  return Warper(bounds_organ()).draw(bounds_organ().proxy.vertices, view, {}, frame);
}

TEST(WarperBounds, AnyPictureSizeWorks) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 300}, {7, 5}, {129, 127}, {3840, 2160}}) {
    Frame frame;
    draw(front(width, height), frame);
    EXPECT_EQ(frame.color.pixels.size(), std::size_t(3) * width * height);
    EXPECT_EQ(frame.cover.size(), std::size_t(width) * height);
    EXPECT_EQ(holes_in(frame), 0u) << width << " × " << height;
  }
}

TEST(WarperBounds, AnEyeAtTheSkinInsideAndAtTheCentreIsHarmless) {
  for (const double away : {0.3, 0.2, 0.1, 0.02, 1e-9, 0.0}) {
    Frame frame;
    EXPECT_NO_THROW(draw(front(160, 120, away), frame)) << away;
    EXPECT_EQ(frame.cover.size(), 160u * 120u);
  }
}

// A texel's patch goes on as a plane as far as the next texel, and so may run behind an eye that is
// nearer than that to the skin.
TEST(WarperBounds, NothingIsSeenBehindAnEyeInTheSkin) {
  Warper warper(bounds_organ());
  RandomStream random(1);
  Frame frame;
  std::size_t covered = 0;
  for (int i = 0; i < 300; ++i) {
    View view = front(48, 48);
    view.near_mm = 1e-3;
    const std::size_t v = random.below(bounds_organ().proxy.vertices.size());
    const Eigen::Vector3d eye = bounds_organ().proxy.vertices[v] * random.uniform(0.95, 1.05);
    const Eigen::Vector3d aside(random.normal(), random.normal(), random.normal());
    view.camera.camera_from_world = look_at(eye, eye + aside, Eigen::Vector3d::UnitZ());
    DrawOptions options;
    options.keep_depth = true;
    warper.draw(bounds_organ().proxy.vertices, view, options, frame);
    for (const float depth : frame.depth_mm) {
      ASSERT_GT(depth, 0) << "view " << i;
      covered += std::isfinite(depth);
    }
  }
  EXPECT_GT(covered, 1000u);
}

TEST(WarperBounds, SamplesThatNoPixelCanShowAreNotDrawn) {
  Warper warper(bounds_organ());
  Frame frame;
  EXPECT_GT(warper.draw(bounds_organ().proxy.vertices, front(200, 150), {}, frame).samples_drawn,
            0u);
  View aside = front(200, 150);
  aside.camera.intrinsics.cx = 1e5;  // looks past the organ
  const DrawReport missed = warper.draw(bounds_organ().proxy.vertices, aside, {}, frame);
  EXPECT_EQ(missed.samples_drawn, 0u);
  EXPECT_EQ(missed.sample_pixels + missed.base_pixels, 0u);
}

TEST(WarperBounds, BadViewsAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<View> bad(6, front(64, 64));
  bad[0].camera.intrinsics.k1 = 0.1;
  bad[1].camera.intrinsics.width = 0;
  bad[2].camera.intrinsics.height = 20000;
  bad[3].camera.intrinsics.fx = nan;
  bad[4].camera.camera_from_world.translation.x() = nan;
  bad[5].near_mm = 0;
  for (const View& view : bad) {
    Frame frame;
    EXPECT_THROW(draw(view, frame), UsageError);
  }
}

TEST(WarperBounds, BadPositionsAreRefusedAndTheNextFrameIsFine) {
  Warper warper(bounds_organ());
  Frame frame;
  auto positions = bounds_organ().proxy.vertices;
  for (const double odd : {std::numeric_limits<double>::infinity(), std::nan("")}) {
    positions[5].z() = odd;
    EXPECT_THROW(warper.draw(positions, front(64, 64), {}, frame), BadDataError);
  }
  positions.pop_back();
  EXPECT_THROW(warper.draw(positions, front(64, 64), {}, frame), BadDataError);
  EXPECT_GT(warper.draw(bounds_organ().proxy.vertices, front(64, 64), {}, frame).sample_pixels, 0u);
}

TEST(WarperBounds, CollapsedAndInvertedProxiesDoNotCrash) {
  Warper warper(bounds_organ());
  Frame frame;
  std::vector<Eigen::Vector3d> point(bounds_organ().proxy.vertices.size(),
                                     Eigen::Vector3d(10, -20, 30));
  EXPECT_NO_THROW(warper.draw(point, front(128, 128), {}, frame));
  auto inverted = bounds_organ().proxy.vertices;
  for (auto& v : inverted) v = 2 * Eigen::Vector3d(10, -20, 30) - v;
  EXPECT_NO_THROW(warper.draw(inverted, front(128, 128), {}, frame));
  auto far = bounds_organ().proxy.vertices;
  for (auto& v : far) v *= 1e12;
  EXPECT_NO_THROW(warper.draw(far, front(128, 128), {}, frame));
}

TEST(WarperBounds, MapsThatDoNotFitAreRefused) {
  const auto refused = [](auto spoil) {
    Bundle bundle = bounds_organ();
    spoil(bundle);
    EXPECT_THROW(Warper{bundle}, BadDataError);
  };
  refused([](Bundle& b) { b.maps[2].depth_mm.pop_back(); });
  refused([](Bundle& b) { b.maps.pop_back(); });
  refused([](Bundle& b) {
    for (auto& face : b.maps[0].face) face = face == kNoFace ? face : 1000;
  });
  refused([](Bundle& b) { b.base.color.pop_back(); });
}

TEST(WarperBounds, AnOrganNobodySawDrawsBackground) {
  Bundle bundle = bounds_organ();
  for (CameraMaps& maps : bundle.maps) std::fill(maps.face.begin(), maps.face.end(), kNoFace);
  bundle.base = {};
  Frame frame;
  const DrawReport report = Warper(bundle).draw(bundle.proxy.vertices, front(64, 64), {}, frame);
  EXPECT_EQ(report.samples_drawn, 0u);
  for (const Cover cover : frame.cover) ASSERT_EQ(cover, Cover::background);
}

TEST(WarperBounds, SharesStayContinuousWhenSmallOnesAreDropped) {
  const ViewWeights just_above = trimmed({{0, 1, 2}, {0.5, 0.49 - 1e-9, 0.01 + 1e-9}});
  const ViewWeights just_below = trimmed({{0, 1, 2}, {0.5, 0.49 + 1e-9, 0.01 - 1e-9}});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(just_above.weights[i], just_below.weights[i], 1e-7);
  EXPECT_EQ(just_below.weights[2], 0);
  const ViewWeights w = trimmed({{0, 1, 2}, {0.2, 0.3, 0.5}});
  EXPECT_NEAR(w.weights[0] + w.weights[1] + w.weights[2], 1, 1e-12);
}

}  // namespace
}  // namespace organbake
