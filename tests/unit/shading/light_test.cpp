// SPDX-License-Identifier: GPL-3.0-or-later

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/shape_from_shading.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;

double angle_degrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) / kOneDegree;
}

// Up to the convex/concave flip, which turns the tilt by π.
double error_degrees(DistantLight found, const DistantLight& truth) {
  const double straight = angle_degrees(found.toward(), truth.toward());
  found.tilt_rad += std::numbers::pi;
  return std::min(straight, angle_degrees(found.toward(), truth.toward()));
}

// Of other surfaces than three little is promised: a picture of one need not tell its light.
TEST(LightEstimate, ThirtyTwoLightsOnEachSurface) {
  for (const std::string& name : distant_scene_names()) {
    double sum = 0, worst = 0;
    for (int tilt = 0; tilt < 8; ++tilt)
      for (double slant : {15., 30., 45., 60.}) {
        const DistantLight light{tilt * 45 * kOneDegree + 0.1, slant * kOneDegree};
        const DistantScene scene = distant_scene(name, 96, light);
        const double error =
            error_degrees(estimate_light(scene.intensity, Mask(96, 96, 1)).light, light);
        sum += error;
        worst = std::max(worst, error);
      }
    const bool promised = name == "vase" || name == "sphere" || name == "gauss";
    EXPECT_LT(sum / 32, promised ? 5 : 50) << name;
    EXPECT_LE(worst, promised ? 15 : 90) << name;
  }
}

TEST(LightEstimate, AlbedoIsFoundAndGainDoesNotMatter) {
  const DistantLight light{0.7, 0.6};
  DistantScene scene = distant_scene("sphere", 96, light);
  for (float& value : scene.intensity.values) value *= 1e-3F;
  const LightEstimate estimate = estimate_light(scene.intensity, Mask(96, 96, 1));
  EXPECT_NEAR(estimate.albedo, 1e-3, 3e-5);
  EXPECT_LT(error_degrees(estimate.light, light), 3);
}

// What a light beside the lens makes of a scene.
Plane lit_from_beside(const NearScene& scene, const LaparoscopeOptions& options) {
  const Plane ratio = light_ratio(scene.log_range, ray_grid(scene.camera), options);
  Plane intensity = scene.intensity;
  for (std::size_t k = 0; k < ratio.size(); ++k) intensity.values[k] *= ratio.values[k];
  return intensity;
}

double median_range(const NearScene& scene) {
  std::vector<float> values = scene.log_range.values;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return std::exp(values[values.size() / 2]);
}

TEST(OffsetLight, RatioIsOneForACentralEvenLight) {
  const NearScene scene = near_scene(0.5, 32);
  const Plane ratio = light_ratio(scene.log_range, ray_grid(scene.camera), {});
  for (float value : ratio.values) EXPECT_FLOAT_EQ(value, 1);
}

TEST(OffsetLight, KnowingTheOffsetBringsTheErrorDown) {
  const NearScene scene = near_scene(0.5, 96);
  const Mask inside(96, 96, 1);
  for (double offset : {2.0, 5.0, 10.0}) {
    const LaparoscopeOptions options{.light_offset_x_mm = offset};
    const Plane intensity = lit_from_beside(scene, options);
    const RangeEstimate ignorant = shade_laparoscope(intensity, inside, scene.camera, {});
    const RangeEstimate told =
        shade_laparoscope(intensity, inside, scene.camera, options, nullptr, median_range(scene));
    const double error = relative_error_percent(told.log_range, scene.log_range);
    EXPECT_LT(error, 0.5 * relative_error_percent(ignorant.log_range, scene.log_range)) << offset;
    EXPECT_LT(error, 0.1 + 0.1 * offset) << offset;
  }
}

TEST(OffsetLight, BeamProfileIsTakenOut) {
  const NearScene scene = near_scene(0.5, 96);
  const LaparoscopeOptions options{.beam_exponent = 3};
  const RangeEstimate told =
      shade_laparoscope(lit_from_beside(scene, options), Mask(96, 96, 1), scene.camera, options);
  EXPECT_LT(relative_error_percent(told.log_range, scene.log_range), 0.3);
}

TEST(OffsetLight, AnOffsetNeedsARange) {
  const NearScene scene = near_scene(0.5, 32);
  EXPECT_THROW(
      shade_laparoscope(scene.intensity, Mask(32, 32, 1), scene.camera, {.light_offset_x_mm = 3}),
      UsageError);
}

}  // namespace

// The light divided out of a frame, against the phantom's own albedo.
namespace {

constexpr double kAlbedo_db = 28;     // below, what is lit anew shows the light that was
constexpr double kGlintsLeft = 0.02;  // of the highlights' light, where they were

struct AlbedoErrors {
  double psnr_db = 0;      // encoded, on tissue that counts, after one scale
  double glints_left = 0;  // of the highlights' light: what stands above the true albedo
};

Eigen::Vector3d linear_at(const Rgb8Image& image, std::size_t k) {
  const auto& table = linear_from_srgb8();
  return {table[image.pixels[3 * k]], table[image.pixels[3 * k + 1]],
          table[image.pixels[3 * k + 2]]};
}

// What makes one picture most like another where tissue counts: least squares in linear light.
template <class Want, class Have>
double scale_of(const PreparedFrame& frame, const LaparoscopyFrame& truth, const Want& want,
                const Have& have) {
  double both = 0, own = 0;
  for (std::size_t k = 0; k < frame.diffuse.size(); ++k) {
    // Borders of the instrument that the mask leaves show no tissue either.
    if (!frame.diffuse.values[k] || truth.highlights.values[k] || truth.instrument.values[k])
      continue;
    const Eigen::Vector3d found = have(k);
    both += found.dot(want(k));
    own += found.squaredNorm();
  }
  return both / own;
}

// cos / r² of the true surface.
double light_at(const LaparoscopyFrame& truth, std::size_t k) {
  const int width = truth.image.width;
  const Eigen::Vector2d pixel(static_cast<double>(k % width) + 0.5,
                              static_cast<double>(k / width) + 0.5);
  const Eigen::Vector3d point =
      double(truth.depth_mm.values[k]) * unproject(truth.camera.intrinsics, pixel);
  return -truth.normals[k].cast<double>().dot(point.normalized()) / point.squaredNorm();
}

AlbedoErrors errors_of(const FrameAlbedo& albedo, const PreparedFrame& frame,
                       const LaparoscopyFrame& truth) {
  const auto true_albedo = [&](std::size_t k) -> Eigen::Vector3d {
    return truth.albedo[k].cast<double>();
  };
  const double scale = scale_of(frame, truth, true_albedo,
                                [&](std::size_t k) { return linear_at(albedo.color, k); });
  const double full = scale_of(
      frame, truth, [&](std::size_t k) { return linear_at(frame.color, k); },
      [&](std::size_t k) -> Eigen::Vector3d { return true_albedo(k) * light_at(truth, k); });
  // The albedo's own error, which is slow, is not the highlights'.
  Plane error(frame.diffuse.width, frame.diffuse.height);
  Mask plain = frame.diffuse;
  for (std::size_t k = 0; k < error.size(); ++k) {
    plain.values[k] = plain.values[k] && !truth.highlights.values[k];
    error.values[k] =
        static_cast<float>((scale * linear_at(albedo.color, k) - true_albedo(k)).mean());
  }
  const Plane error_around = box_mean(error, plain, error.width / 20);
  double squares = 0, count = 0, left = 0, glints = 0;
  for (std::size_t k = 0; k < frame.diffuse.size(); ++k) {
    const Eigen::Vector3d want = truth.albedo[k].cast<double>();
    if (!frame.tissue.values[k] || want.isZero(0)) continue;
    const Eigen::Vector3d found = scale * linear_at(albedo.color, k);
    if (truth.highlights.values[k]) {
      // Signed: what is filled in is off by the texture it cannot know, up as often as down.
      const double light = full * light_at(truth, k);
      left += light * double(error.values[k] - error_around.values[k]);
      glints += (linear_at(frame.color, k) - light * want).mean();
      continue;
    }
    if (!frame.diffuse.values[k]) continue;
    for (int c = 0; c < 3; ++c) {
      const double off = srgb_from_linear(static_cast<float>(std::clamp(found[c], 0.0, 1.0))) -
                         srgb_from_linear(static_cast<float>(want[c]));
      squares += off * off;
      ++count;
    }
  }
  return {10 * std::log10(count / squares), left / std::max(glints, 1e-9)};
}

FrameAlbedo albedo_of(const LaparoscopyFrame& truth, PreparedFrame& frame) {
  frame = prepare_frame(truth.image, truth.camera.intrinsics, {});
  return divide_light_out(frame, shade_frame(frame, {}), {}, 1);
}

TEST(FrameAlbedo, IsThePhantomsAndHoldsNoHighlights) {
  double glints_left = 0;
  constexpr int kSeeds = 2;  // one tissue, and two
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const LaparoscopyPhantom phantom({.seed = std::uint64_t(seed),
                                      .width = 480,
                                      .height = 360,
                                      .frames = 2,
                                      .two_tissues = seed % 2 == 0});
    const LaparoscopyFrame truth = phantom.frame(1);
    PreparedFrame frame;
    const FrameAlbedo albedo = albedo_of(truth, frame);
    const AlbedoErrors errors = errors_of(albedo, frame, truth);
    EXPECT_GE(errors.psnr_db, kAlbedo_db) << "seed " << seed;
    glints_left += std::abs(errors.glints_left) / kSeeds;
    // A second tissue is brighter where it stands out towards the light: only one tissue tells.
    if (!(seed % 2)) continue;
    EXPECT_GT(albedo.falloff_before, 0.7);
    EXPECT_LT(std::abs(albedo.falloff_left), 0.25);
    EXPECT_LT(std::abs(albedo.cosine_left), 0.5 * albedo.cosine_before);
  }
  EXPECT_LE(glints_left, kGlintsLeft);
}

// What is baked is what a player needs to show the frame again.
TEST(FrameAlbedo, UnderItsLightIsTheFrame) {
  const LaparoscopyFrame truth =
      LaparoscopyPhantom({.width = 320, .height = 240, .frames = 1, .light_offset_x_mm = 5})
          .frame(0);
  const PreparedFrame frame = prepare_frame(truth.image, truth.camera.intrinsics, {});
  ShadingOptions options;
  options.range_mm = 55;
  options.laparoscope.light_offset_x_mm = 5;
  options.laparoscope.beam_exponent = 2;
  const FrameDepth depth = shade_frame(frame, options);
  const FrameAlbedo albedo = divide_light_out(frame, depth, options.laparoscope, 1);
  const ScopeLight scope = laparoscope_lighting(options.laparoscope).scope.value();
  const double exponent = wet_gloss().front().exponent;
  for (const auto& [known, sharper] : {std::pair(1.0, 1), std::pair(0.25, 4), std::pair(0.0, 10)})
    EXPECT_NEAR(laparoscope_lighting(options.laparoscope, known).gloss.front().exponent,
                sharper * exponent, 1e-9);
  EXPECT_NEAR(std::tan(scope.beam_half_angle_rad), 1, 1e-12);  // cos² is the same beam
  int compared = 0;
  for (int y = 20; y < 220; y += 20)
    for (int x = 50; x < 270; x += 20) {
      const std::size_t k = frame.diffuse.index(x, y);
      if (!frame.diffuse.values[k] || truth.highlights.values[k]) continue;
      const Eigen::Vector3d point =
          double(depth.depth.values[k]) * unproject(frame.camera, {x + 0.5, y + 0.5});
      const Eigen::Vector3d toward = scope.offset_mm - point;
      const double cosine = depth.normals[k].cast<double>().dot(toward.normalized());
      const double beam = toward.z() * toward.z() / toward.squaredNorm();
      const double light =
          albedo.reference_mm * albedo.reference_mm / toward.squaredNorm() * beam * cosine;
      // Of eight bits, and of a highlight's glow that was taken out.
      const Eigen::Vector3d lit = light * linear_at(albedo.color, k);
      compared += (lit - linear_at(frame.color, k)).cwiseAbs().maxCoeff() < 0.01;
    }
  EXPECT_GT(compared, 60);
}

TEST(FrameAlbedo, OfNothingButHighlightsIsRefused) {
  PreparedFrame frame;
  frame.color = Rgb8Image(32, 24);
  frame.camera = assumed_camera(32, 24, 1.2);
  frame.tissue = Mask(32, 24, 1);
  frame.diffuse = Mask(32, 24, 0);
  frame.highlights = Mask(32, 24, 1);
  FrameDepth depth;
  depth.depth = Plane(32, 24, 50);
  depth.normals.assign(32 * 24, Eigen::Vector3f(0, 0, -1));
  EXPECT_THROW(divide_light_out(frame, depth, {}, 1), BadDataError);
}

}  // namespace

// Detail that halving takes comes back from the frame, but not into what was filled.
namespace {

TEST(OwnPixels, BringBackWhatHalvingTook) {
  constexpr int kWidth = 65, kHeight = 40;  // an odd column falls away
  Rgb8Image frame(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) frame.at(x, y)[c] = (x + y) % 2 ? 130 : 110;
  PreparedFrame reduced;
  reduced.color = half_size(frame);
  reduced.diffuse = Mask(reduced.color.width, reduced.color.height, 1);
  for (int y = 0; y < reduced.diffuse.height; ++y)
    for (int x = 0; x < 8; ++x) reduced.diffuse.at(x, y) = 0;
  Rgb8Image brighter = reduced.color;  // as where light is divided out
  for (std::uint8_t& value : brighter.pixels) value = 200;

  const Rgb8Image same = with_own_pixels(reduced.color, reduced, frame, 1);
  ASSERT_EQ(same.width, kWidth);
  ASSERT_EQ(same.height, kHeight);
  const Rgb8Image lit = with_own_pixels(brighter, reduced, frame, 1);
  const auto step = [](const Rgb8Image& image, int x) {
    return std::abs(image.at(x, 20)[1] - image.at(x + 1, 20)[1]);
  };
  EXPECT_NEAR(step(frame, 40), 20, 0);
  EXPECT_NEAR(step(same, 40), 20, 3);
  EXPECT_NEAR(step(same, 63), 20, 3) << "the last column";
  EXPECT_NEAR(step(lit, 40), 20, 3) << "no louder than the frame has it";
  EXPECT_EQ(step(same, 5), 0) << "filled, so smooth";
}

}  // namespace
}  // namespace organbake
