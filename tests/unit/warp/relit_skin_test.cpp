// SPDX-License-Identifier: Apache-2.0
#include "light/relit_skin.h"

#include "light/skin_light.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/shell.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

// An oblique lamp and a sky: a mirrored or transposed normal shows at once.
Lighting oblique_light() {
  return {.ambient_above = {0.3, 0.3, 0.35},
          .ambient_below = {0.1, 0.1, 0.1},
          .up = Vector3d::UnitZ(),
          .lamps = {{Vector3d(0.8, -0.5, 0.33).normalized(), {0.6, 0.6, 0.5}}},
          .gloss = {},
          .scope = {},
          .finish = {}};
}

const SyntheticOptions& lit_organ_options() {
  static const SyntheticOptions options = [] {
    SyntheticOptions o;
    o.base_step_mm = 2;
    return o;
  }();
  return options;
}

Vector3d ellipsoid_normal(const Vector3d& point) {
  const SyntheticOrgan& organ = lit_organ_options().organ;
  return (point - organ.center).cwiseQuotient(organ.half_axes_mm.cwiseAbs2()).normalized();
}

// The organ's colours seen in the light, on skin whose normal at each point at rest is what
// `normal_of` tells.
template <class NormalOf>
Bundle lit_bundle(const SyntheticOptions& options, const Lighting& lighting, NormalOf&& normal_of) {
  Bundle bundle = make_synthetic_bundle(options);
  bundle.lighting = lighting;
  const auto light = [&](const Vector3d& point) -> Vector3f {
    return lighting.diffuse(normal_of(point)).template cast<float>();
  };
  each_texel(bundle, [&](const Vector3d& point, Vector3f& color) {
    color = color.cwiseProduct(light(point));
  });
  BaseLayer& base = bundle.base;
  const std::vector<ShellMatrix> rest = shell_matrices(bundle.proxy);
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    for (std::uint32_t i = 0; i <= base.steps; ++i) {
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t node =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        base.color[node] = base.color[node].cwiseProduct(light(shell_point(
            rest[f], double(i) / base.steps, double(j) / base.steps, base.height_mm[node])));
      }
    }
  }
  return bundle;
}

Bundle lit_bundle(const Lighting& lighting, const Matrix3d& turn) {
  return lit_bundle(lit_organ_options(), lighting, [&](const Vector3d& point) {
    return Vector3d(turn * ellipsoid_normal(point));
  });
}

std::vector<Vector3d> turned(const TriangleMesh& proxy, const Matrix3d& turn) {
  const Vector3d& center = lit_organ_options().organ.center;
  std::vector<Vector3d> positions;
  for (const Vector3d& v : proxy.vertices) positions.push_back(center + turn * (v - center));
  return positions;
}

DrawOptions relit() {
  DrawOptions options;
  options.background = {0, 0, 0};
  options.light = DrawnLight::world;
  return options;
}

DrawOptions as_baked() {
  DrawOptions options = relit();
  options.light = DrawnLight::baked;
  return options;
}

Frame draw_once(const Bundle& bundle, const std::vector<Vector3d>& positions, const View& view,
                const DrawOptions& options) {
  Warper warper(bundle);
  Frame frame;
  warper.draw(positions, view, options, frame);
  return frame;
}

// How near a bundle's picture comes to that of a bundle whose baked light is already right.
double relit_db(const Bundle& baked, const Bundle& truth, const std::vector<Vector3d>& positions,
                const View& view, const DrawOptions& options) {
  const Frame expected = draw_once(truth, positions, view, as_baked());
  std::vector<std::uint8_t> shown(expected.cover.size());
  for (std::size_t i = 0; i < shown.size(); ++i) shown[i] = expected.cover[i] != Cover::background;
  return compare_images(draw_once(baked, positions, view, options).color, expected.color, shown)
      .psnr_db;
}

View front_view(const Bundle& bundle) { return {bundle.cameras.cameras[0], 1}; }

TEST(RelitSkin, SkinThatTurnsTakesTheLightOfWhereItTurnsTo) {
  const Matrix3d turn =
      (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.3, Vector3d::UnitX()))
          .toRotationMatrix();
  const Bundle baked = lit_bundle(oblique_light(), Matrix3d::Identity());
  const Bundle truth = lit_bundle(oblique_light(), turn);
  const auto positions = turned(baked.proxy, turn);
  const View view = front_view(baked);
  // What is left: normals of a lattice of 2 mm at the rim, and 8 bits twice.
  constexpr double kLitAnewDb = 42;
  EXPECT_GT(relit_db(baked, truth, positions, view, relit()), kLitAnewDb);
  EXPECT_LT(relit_db(baked, truth, positions, view, as_baked()), 25) << "the case would not tell";
}

// A smooth dent of all space, (1 − (r/R)²)³ deep about a centre.
struct Dent {
  Vector3d center, push_mm;
  double reach_mm;

  double depth(const Vector3d& point) const {
    return std::max(0.0, 1 - (point - center).squaredNorm() / (reach_mm * reach_mm));
  }
  Vector3d moved(const Vector3d& point) const {
    return point + std::pow(depth(point), 3) * push_mm;
  }
  Matrix3d gradient(const Vector3d& point) const {
    const double slope = -6 * std::pow(depth(point), 2) / (reach_mm * reach_mm);
    return Matrix3d::Identity() + slope * push_mm * (point - center).transpose();
  }
  Vector3d normal(const Vector3d& point) const {
    return (gradient(point).inverse().transpose() * ellipsoid_normal(point)).normalized();
  }
};

struct DentCase {
  int subdivisions;
  double least_db;  // between what faces' own gradients give (33.8, 40.4, 47.4) and what was met
};

class RelitDent : public testing::TestWithParam<DentCase> {};

// Pushed skin is lit as a smooth dent is, not as the flat faces of the proxy that it moves.
TEST_P(RelitDent, IsLitAsItsSmoothSkinWouldBe) {
  const SyntheticOrgan& organ = lit_organ_options().organ;
  const Dent dent{organ.center - Vector3d(0, organ.half_axes_mm.y(), 0), {0, 12, 0}, 50};
  SyntheticOptions options = lit_organ_options();
  options.proxy_subdivisions = GetParam().subdivisions;
  const Bundle baked = lit_bundle(options, oblique_light(), ellipsoid_normal);
  const Bundle truth = lit_bundle(options, oblique_light(),
                                  [&](const Vector3d& point) { return dent.normal(point); });
  std::vector<Vector3d> positions;
  for (const Vector3d& v : baked.proxy.vertices) positions.push_back(dent.moved(v));
  const auto& cameras = baked.cameras.cameras;
  const View toward_dent{*std::min_element(cameras.begin(), cameras.end(),
                                           [](const PosedCamera& a, const PosedCamera& b) {
                                             return a.center_world_mm().y() <
                                                    b.center_world_mm().y();
                                           }),
                         1};
  EXPECT_GT(relit_db(baked, truth, positions, toward_dent, relit()), GetParam().least_db);
  EXPECT_LT(relit_db(baked, truth, positions, toward_dent, as_baked()), 28)
      << "the case would not tell";
}

INSTANTIATE_TEST_SUITE_P(Proxies, RelitDent,
                         testing::Values(DentCase{1, 35}, DentCase{2, 45}, DentCase{3, 50}),
                         [](const auto& info) {
                           return std::to_string(20 << (2 * info.param.subdivisions)) + "Faces";
                         });

TEST(RelitSkin, MattSkinAtRestKeepsItsBytes) {
  const Bundle bundle = lit_bundle(oblique_light(), Matrix3d::Identity());
  const View view = front_view(bundle);
  EXPECT_EQ(draw_once(bundle, bundle.proxy.vertices, view, relit()).color.pixels,
            draw_once(bundle, bundle.proxy.vertices, view, as_baked()).color.pixels);
}

TEST(RelitSkin, AFrameDoesNotDependOnTheOnesBeforeOrOnThreads) {
  Lighting glossy = oblique_light();
  glossy.gloss = {{0.2, 40}};
  for (const Lighting& light : {oblique_light(), glossy}) {
    const Bundle bundle = lit_bundle(light, Matrix3d::Identity());
    Warper warper(bundle);
    Frame frame;
    // The dent faces the cameras in turn, or away: its light is worked out when it comes into view.
    for (const double depth_mm : {6.0, 0.0}) {
      const auto positions = dented(bundle.proxy, {0, -1, 0}, depth_mm);
      for (const std::size_t c : {2, 0, 3}) {  // the dent lies behind, in front, at the side
        const PosedCamera& camera = bundle.cameras.cameras[c];
        const View view{camera, 1};
        warper.draw(positions, view, relit(), frame);
        const ThreadLimit limit(1);
        EXPECT_EQ(frame.color.pixels, draw_once(bundle, positions, view, relit()).color.pixels)
            << "dented by " << depth_mm << " mm, from " << camera.name;
      }
    }
    // Unlit while it moves, lit after it.
    const auto moved = dented(bundle.proxy, {0, -1, 0}, 8);
    warper.draw(moved, front_view(bundle), as_baked(), frame);
    warper.draw(moved, front_view(bundle), relit(), frame);
    EXPECT_EQ(frame.color.pixels,
              draw_once(bundle, moved, front_view(bundle), relit()).color.pixels);
    for (const double depth_mm : {0.0, 6.0, 9.0, 3.0, 0.0}) {  // and within one view
      const auto positions = dented(bundle.proxy, {0, -1, 0}, depth_mm);
      warper.draw(positions, front_view(bundle), relit(), frame);
      EXPECT_EQ(frame.color.pixels,
                draw_once(bundle, positions, front_view(bundle), relit()).color.pixels)
          << "dented by " << depth_mm << " mm";
    }
  }
}

TEST(RelitSkin, TheHighlightSitsHalfWayBetweenLampAndEye) {
  Lighting glossy = oblique_light();
  glossy.gloss = {{1, 100}};
  Bundle bundle = lit_bundle(glossy, Matrix3d::Identity());
  paint(bundle, 0);
  const View view = front_view(bundle);
  const Frame frame = draw_once(bundle, bundle.proxy.vertices, view, relit());
  Rgb8Image expected(frame.color.width, frame.color.height);
  std::vector<std::uint8_t> inside(frame.cover.size(), 0);
  const Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
  for (int y = 0; y < expected.height; ++y) {
    for (int x = 0; x < expected.width; ++x) {
      const Vector3d eye = view.camera.center_world_mm();
      const Vector3d ray = world_from_view * unproject(view.camera.intrinsics, {x + 0.5, y + 0.5});
      const double t = lit_organ_options().organ.trace(eye, ray);
      if (!std::isfinite(t)) continue;
      const Vector3d gloss = glossy.glossy(ellipsoid_normal(eye + t * ray), -ray.normalized());
      for (int c = 0; c < 3; ++c)
        expected.at(x, y)[c] = srgb8_from_linear(static_cast<float>(gloss[c]));
      inside[std::size_t(y) * expected.width + x] = frame.covered(x, y);
    }
  }
  EXPECT_GT(*std::max_element(expected.pixels.begin(), expected.pixels.end()), 150);
  EXPECT_GT(compare_images(frame.color, expected, inside).psnr_db, 35);
}

TEST(RelitSkin, WithoutABaseLayerThereIsNoMacroSurfaceToLight) {
  Bundle bundle = lit_bundle(oblique_light(), Matrix3d::Identity());
  bundle.base = {};
  EXPECT_NO_THROW(draw_once(bundle, bundle.proxy.vertices, front_view(bundle), as_baked()));
  EXPECT_THROW(draw_once(bundle, bundle.proxy.vertices, front_view(bundle), relit()), UsageError);
}

TEST(RelitSkin, WithoutAKnownLightItIsRefused) {
  const Bundle bundle = make_synthetic_bundle(lit_organ_options());
  EXPECT_THROW(draw_once(bundle, bundle.proxy.vertices, front_view(bundle), relit()), UsageError);
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kShadingTexel_mm = 0.25f;  // steps of 1 mm are smooth, of 2 mm are not
struct ShadedRows {
  SparseShading::Rows depth_mm;
  int rows, count, asked = 0;

  explicit ShadedRows(int of_rows = kSpanRows, int pixels = kSpan) : rows(of_rows), count(pixels) {
    for (auto& row : depth_mm) std::fill_n(row, kSpan, 300.f);
  }
  // Four rows of a plane: number_of(row, pixel) tells what it is where it is asked for.
  template <class NumberOf>
  std::array<std::vector<float>, kSpanRows> mixed(const NumberOf& number_of) {
    const SparseShading span(depth_mm, rows, count, kShadingTexel_mm);
    asked = span.knot_count();
    SkinPlanes knots{};
    for (int k = 0; k < asked; ++k)
      knots.of[1][k] = number_of(span.knot(k) / kSpan, span.knot(k) % kSpan);
    std::array<std::vector<float>, kSpanRows> plane;
    for (int g = 0; g < span.groups(); ++g) {
      SkinPlanes group;
      span.mix(g, knots, group);
      for (int i = 0; i < SparseShading::kPixels; ++i)
        plane[i / SparseShading::kGroup].push_back(group.of[1][i]);
    }
    return plane;
  }
};

TEST(SparseShading, WhatRisesEvenlyIsMixedExactlyFromEightOfFourRows) {
  ShadedRows span;
  const auto number = [](int r, int i) { return 0.5f + 0.25f * float(i) + 0.5f * float(r); };
  const auto plane = span.mixed(number);
  EXPECT_EQ(span.asked, kSpan * 8 / SparseShading::kGroup);
  for (int r = 0; r < kSpanRows; ++r)
    for (int i = 0; i < kSpan; ++i) EXPECT_NEAR(plane[r][i], number(r, i), 1e-5) << r << ", " << i;
}

// Where a row breaks off, and in a group that the span's end cuts, every pixel is asked for,
// however its light jumps; rows that run on beside it by four of sixteen.
TEST(SparseShading, BrokenSkinIsAskedForByThePixel) {
  ShadedRows span(kSpanRows, 70);
  span.depth_mm[1][3] = 302;         // a step in the first group
  span.depth_mm[1][33] = kInfinity;  // a hole in the third
  const auto number = [](int r, int i) { return static_cast<float>((r + i) % 3); };
  const auto plane = span.mixed(number);
  for (const int i : {0, 1, 2, 3, 4, 5, 14, 15, 32, 34, 46, 47, 64, 65, 69})
    EXPECT_EQ(plane[1][i], number(1, i)) << i;
  for (const int i : {16, 21, 26, 31})
    EXPECT_NEAR(plane[1][i], number(0, i) + (number(3, i) - number(0, i)) / 3, 1e-6) << i;
  EXPECT_EQ(plane[1][33], 0) << "not skin";
  EXPECT_NEAR(plane[2][3], number(2, 0) + 0.6f * (number(2, 5) - number(2, 0)), 1e-6);
  for (const int i : {64, 65, 69}) EXPECT_EQ(plane[3][i], number(3, i)) << i;
}

// The last pixel before an outline speaks for no other: where it falls away, or the last row does.
TEST(SparseShading, WhatFallsAwayAtAnEndIsNotMixed) {
  const auto number = [](int r, int i) { return static_cast<float>((r + i) % 3); };
  ShadedRows aside, below;
  for (auto& row : aside.depth_mm) row[15] = 300.4f;
  std::fill_n(below.depth_mm[3], kSpan, 300.6f);
  const auto beside = aside.mixed(number), over = below.mixed(number);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(beside[1][i], number(1, i)) << i;
  for (const int r : {1, 2})
    for (const int i : {0, 5, 10, 15}) EXPECT_EQ(over[r][i], number(r, i)) << r << ", " << i;
}

// Rows that lie behind one another are not mixed, nor is a picture's last rows' lack of others.
TEST(SparseShading, RowsApartAreNotMixed) {
  const auto number = [](int r, int i) { return static_cast<float>(10 * r + i % 2); };
  ShadedRows apart, few(2);
  std::fill_n(apart.depth_mm[2], kSpan, 310.f);
  for (ShadedRows* span : {&apart, &few}) {
    const auto plane = span->mixed(number);
    for (int r = 0; r < span->rows; ++r)
      for (const int i : {0, 5, 10, 15}) EXPECT_EQ(plane[r][i], number(r, i)) << r << ", " << i;
  }
}

}  // namespace
}  // namespace organbake
