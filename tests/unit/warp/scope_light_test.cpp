// SPDX-License-Identifier: Apache-2.0

#include <numeric>

#include "light/relit_skin.h"
#include "light/scope_shine.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Light without a direction: colours are the albedo.
Lighting scope_light(const SkinFinish& finish = {}, std::vector<Lighting::Lobe> gloss = {}) {
  Lighting light;
  light.ambient_above = light.ambient_below = Vector3d::Ones();
  light.gloss = std::move(gloss);
  light.scope = ScopeLight{{6, -4, 1}, 150, 0.5, 0.9};
  light.finish = finish;
  return light;
}

SyntheticOptions scope_organ() {
  SyntheticOptions options;
  options.base_step_mm = 2;
  return options;
}

// An organ of one colour, or with its texture for a negative one.
Bundle organ_in(const Lighting& lighting, float albedo) {
  Bundle bundle = make_synthetic_bundle(scope_organ());
  bundle.lighting = lighting;
  if (albedo >= 0) paint(bundle, albedo);
  return bundle;
}

View front_of(const Bundle& bundle, double zoom = 1) {
  View view{bundle.cameras.cameras[0], 1};
  Intrinsics& lens = view.camera.intrinsics;
  lens.width = static_cast<int>(std::lround(lens.width * zoom));
  lens.height = static_cast<int>(std::lround(lens.height * zoom));
  lens.fx *= zoom, lens.fy *= zoom, lens.cx *= zoom, lens.cy *= zoom;
  return view;
}

DrawOptions from_scope() {
  DrawOptions options;
  options.background = {0, 0, 0};
  options.light = DrawnLight::scope;
  return options;
}

Frame drawn_by_scope(const Bundle& bundle, const std::vector<Vector3d>& positions, const View& view,
                     const DrawOptions& options = from_scope()) {
  Warper warper(bundle);
  Frame frame;
  warper.draw(positions, view, options, frame);
  return frame;
}

Frame drawn_by_scope(const Bundle& bundle, const View& view) {
  return drawn_by_scope(bundle, bundle.proxy.vertices, view);
}

double mean_light(const Frame& frame) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.cover.size(); ++i) {
    if (frame.cover[i] == Cover::background) continue;
    sum += linear_from_srgb8()[frame.color.pixels[3 * i]];
    ++count;
  }
  return sum / static_cast<double>(count);
}

// What ScopeLight's docstring says, worked out by itself for each pixel of a view. Returns nothing
// where the organ is not.
struct ScopeTruth {
  const Bundle& bundle;
  const View& view;
  const SyntheticOrgan organ = scope_organ().organ;

  bool at(int x, int y, float albedo, Vector3d& light) const {
    const Eigen::Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
    const Vector3d eye = view.camera.center_world_mm();
    const Vector3d ray = world_from_view * unproject(view.camera.intrinsics, {x + 0.5, y + 0.5});
    const double t = organ.trace(eye, ray);
    if (!std::isfinite(t)) return false;
    const Lighting& lighting = *bundle.lighting;
    const Vector3d point = eye + t * ray;
    const Vector3d normal =
        (point - organ.center).cwiseQuotient(organ.half_axes_mm.cwiseAbs2()).normalized();
    const Vector3d toward = eye + world_from_view * lighting.scope->offset_mm - point;
    const double range = toward.norm(), ahead = -toward.dot(world_from_view.col(2)) / range;
    const double tan_half = std::tan(lighting.scope->beam_half_angle_rad);
    const double share = lighting.scope->gain * std::pow(lighting.scope->reference_mm / range, 2) /
                         (1 + (1 / (ahead * ahead) - 1) / (tan_half * tan_half));
    const double cosine = normal.dot(toward) / range;
    const Vector3d half = (toward / range - ray.normalized()).normalized();
    Vector3d gloss = Vector3d::Zero();
    for (const Lighting::Lobe& lobe : lighting.gloss) {
      const bool film = lobe.exponent >= WetFilm::kWidestFilm;
      const double alpha2 = (film ? WetFilm::kFilmWidth : 1) * 2 / (lobe.exponent + 2);
      const double c = normal.dot(half), ratio = alpha2 / (1 - c * c * (1 - alpha2));
      for (int k = 0; k < 3; ++k)
        gloss[k] += lobe.strength *
                    (film ? std::pow(ratio, 4) : ScopeShine::kSheen[k] * std::pow(ratio, 2));
    }
    const Vector3d& soft = lighting.finish.softness;
    for (int c = 0; c < 3; ++c)
      light[c] = share * (albedo * std::max(0.0, (cosine + soft[c]) / (1 + soft[c])) + gloss[c]);
    return true;
  }
};

double truth_db(const Bundle& bundle, float albedo) {
  const View view = front_of(bundle);
  const Frame frame = drawn_by_scope(bundle, view);
  const ScopeTruth truth{bundle, view};
  Rgb8Image expected(frame.color.width, frame.color.height);
  std::vector<std::uint8_t> inside(frame.cover.size(), 0);
  for (int y = 0; y < expected.height; ++y) {
    for (int x = 0; x < expected.width; ++x) {
      Vector3d light;
      if (!truth.at(x, y, albedo, light)) continue;
      for (int c = 0; c < 3; ++c)
        expected.at(x, y)[c] = srgb8_from_linear(static_cast<float>(light[c]));
      inside[std::size_t(y) * expected.width + x] = frame.covered(x, y);
    }
  }
  EXPECT_GT(*std::max_element(expected.pixels.begin(), expected.pixels.end()), 100);
  return compare_images(frame.color, expected, inside).psnr_db;
}

// Outlines' smooth borders and the lattice's normals leave this much.
constexpr double kByFormulaDb = 33;

TEST(ScopeLight, FallsOffWithRangeBeamAndCosine) {
  EXPECT_GT(truth_db(organ_in(scope_light(), 0.5f), 0.5f), kByFormulaDb);
}

TEST(ScopeLight, SoftSkinIsLitBeyondItsTerminator) {
  SkinFinish soft;
  soft.softness = {0.4, 0.2, 0};
  EXPECT_GT(truth_db(organ_in(scope_light(soft), 0.5f), 0.5f), kByFormulaDb);
}

TEST(ScopeLight, SmoothGlossIsHalfWayBetweenLightAndEye) {
  for (const double exponent : {20, 200})
    EXPECT_GT(truth_db(organ_in(scope_light({}, {{0.7, exponent}}), 0.02f), 0.02f), kByFormulaDb);
}

// On the inside of a fold or of a cut: as the other side, turned to the eye, but without gloss; and
// never in the surroundings' grey alone.
TEST(ScopeLight, SkinSeenFromBehindIsLitAsItsOtherSide) {
  SkinFinish finish;
  finish.rim = 0.05;
  ScopeShine shine(scope_light(finish, {{0.7, 200}}));
  const Bundle bundle = organ_in(scope_light(), 0.5f);
  const View view = front_of(bundle);
  shine.look(view, 150);
  const Eigen::Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
  constexpr int kAngles = 16;  // round the eye's direction, by pairs of a normal and its opposite
  ScopeSkin skin{};
  skin.count = 2 * kAngles;
  ScopeLit lit;
  for (int i = 0; i < skin.count; ++i) {
    const double angle = 0.01 + 1.5 * (i / 2) / kAngles;
    const Vector3d normal =
        world_from_view * Vector3d(std::sin(angle), 0, -std::cos(angle)) * (i % 2 ? -1 : 1);
    for (int c = 0; c < 3; ++c) {
      skin.normals.of[c][i] = static_cast<float>(normal[c]);
      lit.times.of[c][i] = 0.5f;
    }
    skin.column[i] = static_cast<float>(view.camera.intrinsics.cx + i / 2) + 0.5f;
    skin.row[i] = static_cast<float>(view.camera.intrinsics.cy) + 0.5f;
    skin.depth_mm[i] = 120;
  }
  shine.light(skin, lit);
  const auto color = [&](int c, int i) { return lit.times.of[c][i] + lit.rim[i] + lit.sheen[i]; };
  for (int i = 0; i < skin.count; i += 2) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(color(c, i), color(c, i + 1), 1e-6f) << i;
    EXPECT_GT(color(0, i + 1), 0.01f) << i;
  }
  // Of two alike, one seen from behind, the film shows on one.
  std::array<float, kSpan> white;
  std::array<std::int32_t, kSpan> at;
  white.fill(1), std::iota(at.begin(), at.end(), 0);
  for (int c = 0; c < 3; ++c) std::copy_n(skin.normals.of[c], skin.count, skin.rest_normals.of[c]);
  SkinPlanes gloss{};
  const std::array row = {
      SpanColors{0, 0, skin.count, gloss.planes(), white.data(), skin.depth_mm}};
  shine.film().add(shine.view(), skin, at.data(), row);
  EXPECT_GT(gloss.of[0][0], 0.01f);
  for (int i = 0; i < skin.count; i += 2) EXPECT_EQ(gloss.of[0][i + 1], 0) << i;
}

TEST(ScopeLight, SkinKeepsItsOwnColours) {
  Lighting even = scope_light();
  const Bundle bundle = organ_in(even, -1);
  // The same organ, its colours taken in a light from one side: divided out again.
  Lighting lamp = even;
  lamp.ambient_above = lamp.ambient_below = Vector3d::Constant(0.4);
  lamp.lamps = {{Vector3d(0.3, -0.9, 0.2).normalized(), {0.6, 0.5, 0.4}}};
  Bundle lit = bundle;
  lit.lighting = lamp;
  const SyntheticOrgan organ = scope_organ().organ;
  const auto light_at = [&](const Vector3d& point) -> Vector3f {
    return lamp
        .diffuse((point - organ.center).cwiseQuotient(organ.half_axes_mm.cwiseAbs2()).normalized())
        .cast<float>();
  };
  each_texel(lit, [&](const Vector3d& point, Vector3f& color) {
    color = color.cwiseProduct(light_at(point));
  });
  const View view = front_of(bundle);
  const Frame expected = drawn_by_scope(bundle, view), frame = drawn_by_scope(lit, view);
  std::vector<std::uint8_t> shown(expected.cover.size());
  for (std::size_t i = 0; i < shown.size(); ++i) shown[i] = expected.cover[i] == Cover::samples;
  EXPECT_GT(compare_images(frame.color, expected.color, shown).psnr_db, 38);
}

TEST(ScopeLight, AMeteredExposureIsTheSameFromNearAndFar) {
  Lighting lighting = scope_light();
  lighting.scope->reference_mm = 0;
  const Bundle bundle = organ_in(lighting, 0.5f);
  View view = front_of(bundle);
  const double near = mean_light(drawn_by_scope(bundle, view));
  view.camera.camera_from_world.translation *= 3;  // along the same ray to the centre, about
  const double far = mean_light(drawn_by_scope(bundle, view));
  EXPECT_NEAR(far / near, 1, 0.1);
  EXPECT_NEAR(near, 0.9 * 0.5 * 0.65, 0.06) << "gain · albedo · the meter's mean";
}

constexpr double kCarriedDb = 22;

// The skin and the eye moved as one see the same relief: it is bound to the skin.
TEST(ScopeLight, TheReliefIsCarriedByTheSkin) {
  SkinFinish rough;
  rough.relief_slope = 0.15, rough.relief_mm = 6;
  const Bundle bundle = organ_in(scope_light(rough, {{0.9, 300}}), 0.1f);
  const View view = front_of(bundle, 3);
  const Vector3d right = view.camera.camera_from_world.rotation.row(0);
  const Eigen::AngleAxisd turn(0.4, right);
  const Vector3d shift(40, 10, -25);
  std::vector<Vector3d> moved;
  for (const Vector3d& v : bundle.proxy.vertices) moved.push_back(turn * v + shift);
  View with_it = view;
  RigidTransform& pose = with_it.camera.camera_from_world;
  pose.rotation = pose.rotation * turn.toRotationMatrix().transpose();
  pose.translation -= pose.rotation * shift;
  const Frame at_rest = drawn_by_scope(bundle, view);
  const Frame carried = drawn_by_scope(bundle, moved, with_it);
  SkinFinish other = rough;
  other.relief_mm = 6.7;
  const Frame elsewhere = drawn_by_scope(organ_in(scope_light(other, {{0.9, 300}}), 0.1f), view);
  // Where either shows a highlight of it.
  const auto db = [&](const Frame& other) {
    std::vector<std::uint8_t> shining(at_rest.cover.size());
    for (std::size_t i = 0; i < shining.size(); ++i)
      shining[i] = std::max(at_rest.color.pixels[3 * i], other.color.pixels[3 * i]) > 110;
    return compare_images(other.color, at_rest.color, shining).psnr_db;
  };
  // Of a turn, that about the normal itself is not followed: a few per cent of the slopes.
  EXPECT_GT(db(carried), kCarriedDb);
  EXPECT_LT(db(elsewhere), kCarriedDb - 8) << "the case would not tell";
}

// Where few drops face the lamp chance tells: so on some reliefs, whose drops lie elsewhere.
TEST(ScopeLight, ReliefFinerThanAPixelKeepsItsLight) {
  double near = 0, far = 0;
  for (const double relief_mm : {1.4, 1.7, 2.0, 2.5}) {
    SkinFinish fine;
    fine.relief_slope = 0.1, fine.relief_mm = relief_mm;
    const Bundle bundle = organ_in(scope_light(fine, {{0.5, 400}}), 0.0f);
    near += mean_light(drawn_by_scope(bundle, front_of(bundle, 6)));
    far += mean_light(drawn_by_scope(bundle, front_of(bundle, 0.75)));
  }
  EXPECT_NEAR(far / near, 1, 0.2);
}

// From near, on skin of one colour: as much as was asked for; from far, nothing is worked out.
TEST(ScopeLight, GrainShowsFromNearAsWidelyAsItsDeviationSays) {
  SkinFinish grainy;
  grainy.grain = {0.1, 0.1, 0.1}, grainy.grain_mm = 4;
  const Bundle even = organ_in(scope_light(), 0.4f), bundle = organ_in(scope_light(grainy), 0.4f);
  const auto deviation = [&](double zoom) {
    const View view = front_of(bundle, zoom);
    const Frame plain = drawn_by_scope(even, view), frame = drawn_by_scope(bundle, view);
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < frame.cover.size(); ++i) {
      const float was = linear_from_srgb8()[plain.color.pixels[3 * i + 1]];
      if (frame.cover[i] != Cover::samples || was < 0.05f) continue;
      const double share = linear_from_srgb8()[frame.color.pixels[3 * i + 1]] / was - 1;
      squares += share * share, ++count;
    }
    return std::sqrt(squares / count);
  };
  EXPECT_NEAR(deviation(6), 0.1, 0.04);
  EXPECT_EQ(deviation(0.1), 0);
}

// Where it only just shows: of no pixel does it depend on the others that are drawn with it.
TEST(ScopeLight, FaintGrainIsTheSameHoweverAPictureIsSharedOut) {
  SkinFinish grainy;
  grainy.grain = {0.05, 0.05, 0.05}, grainy.grain_mm = 4;
  const Bundle bundle = organ_in(scope_light(grainy), 0.4f);
  Warper warper(bundle), shared_warper(bundle);
  Frame frame, shared;
  for (double zoom = 0.6; zoom < 0.9; zoom += 0.02) {
    const View view = front_of(bundle, zoom);
    const auto draw = [&](int threads, Warper& by, Frame& to) {
      const ThreadLimit limit(threads);
      by.draw(bundle.proxy.vertices, view, from_scope(), to);
    };
    draw(1, warper, frame);
    draw(8, shared_warper, shared);
    EXPECT_EQ(frame.color.pixels, shared.color.pixels) << "zoom " << zoom;
  }
}

TEST(ScopeLight, AFrameDoesNotDependOnTheOnesBeforeOrOnThreads) {
  SkinFinish rough;
  rough.grain = {0.1, 0.2, 0.1}, rough.grain_mm = 3;
  rough.relief_slope = 0.1, rough.softness = {0.2, 0.1, 0.1}, rough.rim = 0.2;
  Lighting lighting = scope_light(rough, {{1.5, 300}, {0.05, 40}});
  lighting.scope->reference_mm = 0;
  const Bundle bundle = organ_in(lighting, -1);
  Warper warper(bundle);
  Frame frame;
  for (const double depth_mm : {6.0, 0.0, 9.0, 3.0}) {
    const auto positions = dented(bundle.proxy, {0, -1, 0}, depth_mm);
    for (const std::size_t c : {2, 0, 0, 3}) {
      const View view{bundle.cameras.cameras[c], 1};
      for (const DrawnLight light : {DrawnLight::scope, DrawnLight::world, DrawnLight::scope}) {
        DrawOptions options = from_scope();
        options.light = light;
        warper.draw(positions, view, options, frame);
        const ThreadLimit limit(1);
        ASSERT_EQ(frame.color.pixels, drawn_by_scope(bundle, positions, view, options).color.pixels)
            << to_string(light) << ", dented by " << depth_mm << " mm, camera " << c;
      }
    }
  }
}

TEST(ScopeLight, ABorderThatFadesChangesColoursAloneAndIsTakenBackForTheNextFrame) {
  SkinFinish fading;
  fading.border_fade_rad = 0.02;
  const Bundle bundle = organ_in(scope_light(fading), 0.5f);
  const Bundle sharp_bundle = organ_in(scope_light(), 0.5f);
  const View view = front_of(bundle);
  DrawOptions plain = from_scope(), with_tool = from_scope();
  plain.keep_depth = with_tool.keep_depth = true;
  const auto& rest = bundle.proxy.vertices;
  with_tool.solids = {{.from = rest[0], .to = rest[0] + Vector3d(0, -60, 0)}};
  Warper fades(bundle), ends_sharply(sharp_bundle);
  Frame faded, sharp, anew;
  fades.draw(rest, view, plain, faded);
  ends_sharply.draw(rest, view, plain, sharp);
  EXPECT_NE(faded.color.pixels, sharp.color.pixels);
  EXPECT_EQ(faded.cover, sharp.cover);
  EXPECT_EQ(faded.depth_mm, sharp.depth_mm);
  fades.draw(rest, view, with_tool, faded);
  Warper(bundle).draw(rest, view, with_tool, anew);
  EXPECT_EQ(faded.color.pixels, anew.color.pixels);
  plain.smooth_outline = false;
  fades.draw(rest, view, plain, faded);
  ends_sharply.draw(rest, view, plain, sharp);
  EXPECT_EQ(faded.color.pixels, sharp.color.pixels);
}

TEST(ScopeLight, EachBundleHasTheLightItIsMeantFor) {
  Bundle bundle = organ_in(scope_light(), 0.5f);
  EXPECT_EQ(Warper(bundle).default_light(), DrawnLight::scope);
  bundle.lighting->scope.reset();
  EXPECT_EQ(Warper(bundle).default_light(), DrawnLight::world);
  const View view = front_of(bundle);
  EXPECT_NO_THROW(drawn_by_scope(bundle, view)) << "a known light is enough to be lit by a scope";
  bundle.lighting.reset();
  EXPECT_EQ(Warper(bundle).default_light(), DrawnLight::baked);
  EXPECT_THROW(drawn_by_scope(bundle, view), UsageError);
}

TEST(ScopeLight, NamesAreReadBack) {
  for (const DrawnLight light : {DrawnLight::baked, DrawnLight::world, DrawnLight::scope})
    EXPECT_EQ(drawn_light(to_string(light)), light);
  EXPECT_FALSE(drawn_light("sun"));
}

}  // namespace
}  // namespace organbake
