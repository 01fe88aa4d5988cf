// SPDX-License-Identifier: Apache-2.0
// What keeps the film's light on the skin that it belongs to, while a scope comes near or pokes.
#include "light/scope_shine.h"

#include <numeric>

#include "light/relit_skin.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// As wet as a liver.
Lighting wet_light() {
  Lighting light;
  light.ambient_above = light.ambient_below = Vector3d::Ones();
  light.gloss = {{26, 750}};
  light.scope = ScopeLight{{4, -3, 0}, 60, 0.65, 1};
  light.finish.relief_slope = 0.16, light.finish.relief_mm = 1.4;
  return light;
}

constexpr float kDepth_mm = 1e4f;  // half-way is one direction

// A view straight down, from so far, whose light lies at the eye and is full there.
ScopeView far_view(double pixel_mm, float depth_mm = kDepth_mm) {
  const float inverse_pixel = static_cast<float>(depth_mm / pixel_mm);
  return {{}, {}, {0, 0, -1}, {}, {0, 0, -1}, depth_mm * depth_mm, 1, inverse_pixel};
}

// Pixels of that size from column x0 on of row y of a picture, side × side of them, of a bulge in
// full light. Its numbers are exact, so that all that flickers is the film's. `bend`: of the
// lattice's normals, rad a mm, beyond the bulge's own.
ScopeSkin bulge_span(int y, int side, double pixel_mm, int x0 = 0, float bend = 0) {
  constexpr double kRadius_mm = 60;
  ScopeSkin skin{};
  skin.count = kSpan;
  for (int i = 0; i < kSpan; ++i) {
    const Vector3d across = pixel_mm * Vector3d(x0 + i + 0.5 - 0.5 * side, y + 0.5 - 0.5 * side, 0);
    const double up = std::sqrt(std::max(0.0, kRadius_mm * kRadius_mm - across.squaredNorm()));
    const Vector3f normal = ((across + Vector3d(0, 0, up)) / kRadius_mm).cast<float>();
    for (int c = 0; c < 3; ++c) {
      skin.normals.of[c][i] = skin.rest_normals.of[c][i] = normal[c];
      skin.rest_mm.of[c][i] = float(kRadius_mm) * normal[c];
    }
    skin.depth_mm[i] = kDepth_mm;
    skin.rest_normals.of[3][i] = bend + float(1 / kRadius_mm);
  }
  return skin;
}

// Adds what pixels side by side mirror, from the first of a span on.
void add_in_order(const WetFilm& film, double pixel_mm, const ScopeSkin& skin, SkinPlanes& color) {
  std::array<float, kSpan> white;
  std::array<std::int32_t, kSpan> at;
  white.fill(1), std::iota(at.begin(), at.end(), 0);
  const std::array row = {SpanColors{0, 0, kSpan, color.planes(), white.data(), skin.depth_mm}};
  film.add(far_view(pixel_mm, skin.depth_mm[0]), skin, at.data(), row);
}

// What the film alone mirrors of it.
std::vector<float> film_on_bulge(int side, double pixel_mm, float bend = 0,
                                 const Lighting& lighting = wet_light()) {
  const WetFilm film(lighting);
  std::vector<float> light;
  for (int y = 0; y < side; ++y) {
    for (int x0 = 0; x0 < side; x0 += kSpan) {
      SkinPlanes color{};
      add_in_order(film, pixel_mm, bulge_span(y, side, pixel_mm, x0, bend), color);
      light.insert(light.end(), color.of[0], color.of[0] + kSpan);
    }
  }
  return light;
}

// sRGB means of the blocks of 8 × 8 pixels, each of which is fine × fine numbers of `light`, on
// dark tissue.
std::vector<double> block_means(const std::vector<float>& light, int fine) {
  constexpr int kBlock = 8;
  constexpr float kTissue = 0.03f;
  std::vector<double> means;
  for (int y0 = 0; y0 < kSpan; y0 += kBlock)
    for (int x0 = 0; x0 < kSpan; x0 += kBlock) {
      double sum = 0;
      for (int k = 0; k < kBlock * kBlock; ++k) {
        const int x = fine * (x0 + k % kBlock), y = fine * (y0 + k / kBlock);
        float pixel = 0;
        for (int p = 0; p < fine * fine; ++p)
          pixel += light[std::size_t(y + p / fine) * fine * kSpan + x + p % fine];
        sum += srgb8_from_linear(kTissue + pixel / static_cast<float>(fine * fine));
      }
      means.push_back(sum / (kBlock * kBlock));
    }
  return means;
}

// Drops are as soft as a pixel on every side, and patches do not end within a drop: so what a
// pixel shows goes with the mean of its parts, frame by frame, as a scope comes near.
TEST(WetFilm, FlickersNoMoreThanItsPartsDo) {
  constexpr int kFine = 4, kFrames = 6;
  constexpr double kPixel_mm = 0.45;
  std::vector<double> before, truth_before;
  double squares = 0, steps = 0, count = 0;
  for (int k = 0; k < kFrames; ++k) {
    const double pixel_mm = kPixel_mm * (1 - 0.025 * k);
    const std::vector<double> now = block_means(film_on_bulge(kSpan, pixel_mm), 1);
    const std::vector<double> truth =
        block_means(film_on_bulge(kFine * kSpan, pixel_mm / kFine), kFine);
    for (std::size_t i = 0; i < before.size(); ++i) {
      const double step = truth[i] - truth_before[i];
      squares += std::pow(now[i] - before[i] - step, 2);
      steps += step * step, ++count;
    }
    before = now, truth_before = truth;
  }
  EXPECT_GT(std::sqrt(steps / count), 2) << "nothing moves here";
  // 0.23 as it is; 0.37 where a drop is cut out of a ball round its point.
  EXPECT_LT(std::sqrt(squares / steps), 0.3) << "of what moves";
}

// What is too fine for a pixel is spread, not lost: from afar a bulge shines as from near.
TEST(WetFilm, ShinesAsMuchFromAfarAsFromNear) {
  constexpr double kSide_mm = 83;
  const auto mean = [&](int times) {
    const std::vector<float> light = film_on_bulge(times * kSpan, kSide_mm / (times * kSpan));
    return std::accumulate(light.begin(), light.end(), 0.0) / double(light.size());
  };
  const double near = mean(5);
  EXPECT_GT(near, 0.005);
  EXPECT_NEAR(mean(2), near, 0.05 * near) << "pixels of half a drop's room";
  EXPECT_NEAR(mean(1), near, 0.15 * near) << "of a whole one: the mean of all drops";
}

// Areas of what is brighter than half, in pixels, the largest first.
std::vector<int> highlight_areas(const std::vector<float>& light, int side) {
  std::vector<std::uint8_t> left(light.size());
  for (std::size_t i = 0; i < light.size(); ++i) left[i] = light[i] > 0.5f;
  std::vector<int> areas;
  for (int first = 0; first < side * side; ++first) {
    if (!left[std::size_t(first)]) continue;
    std::vector<int> open = {first};
    left[std::size_t(first)] = 0, areas.push_back(0);
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back(), ++areas.back();
      for (int y = std::max(at / side - 1, 0); y <= std::min(at / side + 1, side - 1); ++y)
        for (int x = std::max(at % side - 1, 0); x <= std::min(at % side + 1, side - 1); ++x)
          if (std::exchange(left[std::size_t(y * side + x)], std::uint8_t{0}))
            open.push_back(y * side + x);
    }
  }
  std::sort(areas.rbegin(), areas.rend());
  return areas;
}

// Laparoscopies show drops of all sizes, that touch and melt where skin faces the lamp.
TEST(WetFilm, DropsAreOfAllSizesAndMelt) {
  constexpr int kSide = 4 * kSpan;
  const std::vector<int> areas = highlight_areas(film_on_bulge(kSide, 0.08), kSide);
  ASSERT_GT(areas.size(), 12u);
  const int usual = areas[areas.size() / 2], small = areas[areas.size() * 9 / 10];
  EXPECT_GT(usual, 3 * std::max(small, 1)) << "of one size, like rice";
  EXPECT_GT(areas.front(), 4 * usual) << "none has melted with its neighbours";
}

// From near a drop is one to its ends, wherever its patch ends: cut off there by what each pixel
// has, it would end straight, and within a pixel.
TEST(WetFilm, DropsEndSoftlyWhereTheirPatchEnds) {
  constexpr int kSide = 8 * kSpan;
  const std::vector<float> light = film_on_bulge(kSide, 0.02);
  int ends = 0, cuts = 0;
  for (int y = 1; y < kSide; ++y)
    for (int x = 1; x < kSide; ++x) {
      const float* const own = &light[std::size_t(y) * kSide + x];
      for (const float* const beside : {own - 1, own - kSide}) {
        ends += (*own > 0.5f) != (*beside > 0.5f);
        cuts += std::abs(*own - *beside) > 0.8f;
      }
    }
  EXPECT_GT(ends, 1000);
  EXPECT_LE(cuts, ends / 1000);
}

// Drops lie in patches of some waves: two that run nearly one way would lay them in stripes.
TEST(WetFilm, NoTwoWavesOfItsPatchesRunOneWay) {
  ScopeShading shading;
  WetFilm(wet_light()).describe(shading);
  const auto course = [&](std::size_t k) { return shading.hill_slope[k].head<3>().normalized(); };
  for (std::size_t i = 0; i < shading.hill_slope.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_LT(std::abs(course(i).dot(course(j))), 0.5f) << j << " and " << i;
}

// Pixels smaller than a drop's room show drops one by one: the mean of all that may lie there would
// be a grey veil between them, and drops that are wet or lit by what pixels beside them have would
// shine where there are none.
TEST(WetFilm, BetweenDropsItIsDark) {
  constexpr int kFine = 4, kReach = 2;  // pixels: as far as soft ends go
  constexpr double kVeil = 2.5e-5;
  for (const double pixel_mm : {0.42, 0.2}) {
    const std::vector<float> shown = film_on_bulge(kSpan, pixel_mm),
                             fine = film_on_bulge(kFine * kSpan, pixel_mm / kFine);
    double veil = 0, dark = 0;
    for (int y = kReach; y + kReach < kSpan; ++y)
      for (int x = kReach; x + kReach < kSpan; ++x) {
        float brightest = 0;
        for (int v = kFine * (y - kReach); v < kFine * (y + kReach + 1); ++v)
          for (int u = kFine * (x - kReach); u < kFine * (x + kReach + 1); ++u)
            brightest = std::max(brightest, fine[std::size_t(v) * kFine * kSpan + u]);
        if (brightest > 0.01f) continue;
        veil += shown[std::size_t(y) * kSpan + x], ++dark;
      }
    EXPECT_GT(dark, 100);
    EXPECT_LT(veil, kVeil * dark) << "pixels of " << pixel_mm << " mm";
  }
}

// A lattice of depth's noise or a crease a pixel wide would mirror the lamp as a line of its own.
TEST(WetFilm, ACreaseDoesNotShine) {
  constexpr int kSide = kSpan;
  const auto burnt_out = [&](float bend) {
    const std::vector<float> light = film_on_bulge(kSide, 0.15, bend);
    return std::count_if(light.begin(), light.end(), [](float v) { return v > 0.3f; });
  };
  EXPECT_GT(burnt_out(0), 100);
  EXPECT_EQ(burnt_out(3), 0) << "3 rad a mm: an edge within a pixel or two";
  EXPECT_GT(burnt_out(0.05f), burnt_out(0) / 2) << "a bump of 20 mm still shines";
}

// As a depth map has it, whose relief is half as rough as a liver's: whole film beside drops would
// be a grey veil.
TEST(WetFilm, AFilmOfSomeDropsIsNoVeil) {
  Lighting light = wet_light();
  light.finish.relief_slope = 0.1;
  constexpr int kSide = 2 * kSpan;
  const std::vector<float> found = film_on_bulge(kSide, 0.1, 0, light);
  const auto grey =
      std::count_if(found.begin(), found.end(), [](float v) { return v > 0.05f && v < 0.7f; });
  const auto white = std::count_if(found.begin(), found.end(), [](float v) { return v >= 0.7f; });
  EXPECT_GT(white, 100);
  EXPECT_LT(grey, white) << "pixels: but for their soft ends drops are white";
}

// A dark organ with creases.
Bundle make_wet_organ() {
  SyntheticOptions options;
  options.organ.lump_share = 0.1;
  options.base_step_mm = 1;
  Bundle bundle = make_synthetic_bundle(options);
  paint(bundle, 0.05f);
  bundle.lighting = wet_light();
  return bundle;
}
const Bundle& wet_organ() {
  static const Bundle bundle = make_wet_organ();
  return bundle;
}

// Light is worked out at some pixels of a group and mixed between them, but not the film's, which
// is finer: where those pixels lie must not tell.
TEST(WetFilm, StaysWhereItIsWhenThePictureIsShifted) {
  constexpr int kShift_px = 4, kWidth_px = 480, kHeight_px = 384;
  const Bundle& bundle = wet_organ();
  const SyntheticOrgan organ;
  Warper warper(bundle);
  DrawOptions options;
  options.light = DrawnLight::scope;
  const auto drawn = [&](int shift_px) {
    View view{bundle.cameras.cameras[0], 1};
    view.camera.intrinsics.width = kWidth_px, view.camera.intrinsics.height = kHeight_px;
    view.camera.intrinsics.fx = view.camera.intrinsics.fy = 600;
    view.camera.intrinsics.cx = 0.5 * kWidth_px + shift_px;
    view.camera.intrinsics.cy = 0.5 * kHeight_px;
    RigidTransform& pose = view.camera.camera_from_world;
    pose.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    const Vector3d eye = organ.center - Vector3d(0, organ.half_axes_mm.y() + 40, 0);
    pose.translation = -pose.rotation * eye;
    Frame frame;
    warper.draw(bundle.proxy.vertices, view, options, frame);
    return frame;
  };
  const Frame frame = drawn(0), shifted = drawn(kShift_px);
  double squares = 0, count = 0;
  for (int y = 0; y < kHeight_px; ++y) {
    for (int x = 0; x + kShift_px < kWidth_px; ++x) {
      const int was = frame.color.at(x, y)[1], is = shifted.color.at(x + kShift_px, y)[1];
      if (std::max(was, is) < 128) continue;
      squares += std::pow(was - is, 2), ++count;
    }
  }
  EXPECT_GT(count, 200) << "nothing shines here";
  // 0.07 as it is; 5.7 where the film's normals and places are mixed, too.
  EXPECT_LT(std::sqrt(squares / count), 1) << "levels of 255, root mean square";
}

// Where drops are asked for is told by how far the film reaches, and by what lies between knots.
TEST(WetFilm, IsAskedForWhereverADropIsLit) {
  const WetFilm film(wet_light());
  for (const auto& [pixel_mm, depth_mm] :  // near, half-way turns over a drop
       {std::pair(0.6, kDepth_mm), {0.6, 20.f}, {0.25, kDepth_mm}, {0.25, 20.f}}) {
    int lit = 0, left_out = 0;
    for (int y = 0; y < kSpan; ++y) {
      ScopeSkin skin = bulge_span(y, kSpan, pixel_mm);
      std::fill_n(skin.depth_mm, kSpan, depth_mm);
      SkinPlanes color{};
      add_in_order(film, pixel_mm, skin, color);
      std::array<std::int32_t, kSpan> asked;
      film.find_lit(far_view(pixel_mm, depth_mm), skin, asked.data());
      for (int i = 0; i < kSpan; ++i) {
        if (skin.normals.of[2][i] < film.reach().least_near_cosine) asked[i] = 0;
        EXPECT_TRUE(asked[i] || color.of[0][i] < 1e-6f) << i << ", " << y;
        lit += color.of[0][i] > 0, left_out += !asked[i];
      }
    }
    EXPECT_GT(lit, 200);
    EXPECT_GT(left_out, kSpan * kSpan * pixel_mm / 1.2);
  }
}

// A sample that reaches over its face's edge is lit as on the edge: its own lattice leans on where
// the next face's does not. The film's place goes on.
TEST(WetFilm, NormalsEndAtTheirFacesEdge) {
  const Bundle& bundle = wet_organ();
  const ShellSurface shell = bundle.shell();
  RelitSkin relit(bundle.base, shell, *bundle.lighting,
                  lattice_normals(bundle.base, shell.at_rest()));
  relit.light_faces(View{bundle.cameras.cameras[0], 1}, DrawnLight::scope, 60, PosedShell(shell),
                    std::vector<std::uint8_t>(bundle.base.face_count, 1));
  // What the light leaves of white, and what the film adds to black.
  const auto lit = [&](float b1, float b2) {
    std::array<SkinPlanes, 2> light{};
    SparseShading::Rows depth;
    std::array<float, kSpan> white;
    std::fill_n(depth[0], kSpan, 60.f), white.fill(1);
    for (auto& channel : light[0].of) std::fill_n(channel, kSpan, 1.f);
    SparseShading span(depth, 1, kSpan, 1);
    const auto skin = [&](int count) {
      SkinPixels pixels;
      for (int i = 0; i < count; ++i)
        pixels.add(i, static_cast<std::uint32_t>(i) % bundle.base.face_count, b1, b2);
      pixels.fill_up();
      return pixels;
    };
    const auto colors = [&](int i) {
      return std::array{SpanColors{0, 0, kSpan, light[i].planes(), white.data(), depth[0]}};
    };
    std::array<std::int32_t, kMostSkin> film_at;
    while (relit.light(skin(span.knot_count()), span, colors(0), film_at.data()) ==
           RelitSkin::kAskAnew) {
    }
    relit.add_film(skin(kSpan), colors(1));
    return light;
  };
  const auto beyond = lit(-0.06f, 0.4f), edge = lit(0, 0.4f), within = lit(0.06f, 0.4f);
  double turned = 0, went_on = 0;
  for (int i = 0; i < kSpan; ++i) {
    EXPECT_EQ(beyond[0].of[1][i], edge[0].of[1][i]) << i;
    turned += std::abs(within[0].of[1][i] - edge[0].of[1][i]);
    went_on += std::abs(beyond[1].of[1][i] - edge[1].of[1][i]);
  }
  EXPECT_GT(turned, 1) << "light hardly changes here";
  EXPECT_GT(went_on, 0.1) << "the film shows no other place";
}

}  // namespace
}  // namespace organbake
