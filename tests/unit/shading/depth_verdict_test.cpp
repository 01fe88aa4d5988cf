// SPDX-License-Identifier: GPL-3.0-or-later
// A depth says whether its picture supports it, and is no worse than a flat plane when it does not.
#include "organbake/shading/depth_verdict.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/video_reader.h"
#include "support/places.h"

namespace organbake {
namespace {

FrameDepth shaded(const Rgb8Image& image, const Intrinsics& camera) {
  return shade_frame(prepare_frame(image, camera, {}), {});
}

// The largest deviation of depth from its mean, relative.
double relief_of(const Plane& depth) {
  double sum = 0, count = 0, largest = 0;
  for (int pass = 0; pass < 2; ++pass)
    for (float z : depth.values) {
      if (!std::isfinite(z)) continue;
      if (pass == 0) sum += z, ++count;
      if (pass == 1) largest = std::max(largest, std::abs(z * count / sum - 1));
    }
  return largest;
}

// A wall across the axis in patches of two albedos but one colour: no shape has such edges.
Rgb8Image patched_wall(const Intrinsics& camera) {
  Rgb8Image image(camera.width, camera.height);
  RandomStream random(4);
  constexpr int kPatch = 24;
  std::vector<double> albedo(1000);
  for (double& value : albedo) value = random.below(2) ? 1 : 0.45;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = unproject(camera, {x + 0.5, y + 0.5});
      const double light = albedo[std::size_t(y / kPatch) * 31 + std::size_t(x / kPatch)] /
                           std::pow(ray.squaredNorm(), 1.5);
      const double tint[3] = {0.8, 0.35, 0.3};
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = srgb8_from_linear(static_cast<float>(light * tint[c]));
    }
  return image;
}

TEST(DepthVerdict, RenderedTissueIsOkAndKeepsItsRelief) {
  for (int seed : {1, 2}) {
    const LaparoscopyPhantom phantom(
        {.seed = static_cast<std::uint64_t>(seed), .width = 320, .height = 240});
    const LaparoscopyFrame frame = phantom.frame(0);
    const FrameDepth depth = shaded(frame.image, frame.camera.intrinsics);
    EXPECT_EQ(depth.quality.verdict, DepthVerdict::ok) << depth.quality.reason;
    EXPECT_GT(relief_of(depth.depth), 0.05);
  }
}

TEST(DepthVerdict, PatchesOfAlbedoAreDoubtfulAndNearFlat) {
  const Intrinsics camera = assumed_camera(320, 240, 1.2);
  const FrameDepth depth = shaded(patched_wall(camera), camera);
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
  EXPECT_THAT(depth.quality.reason, testing::HasSubstr("texture"));
  constexpr double kNearFlat = 0.02;  // a fifth of what is invented
  EXPECT_LT(relief_of(depth.depth), kNearFlat);
  EXPECT_GT(relief_of(depth_from_log_range(depth.range.log_range, ray_grid(camera),
                                           Mask(camera.width, camera.height, 1))),
            0.1)
      << "what is invented";
}

TEST(DepthVerdict, DarknessIsAFailure) {
  const FrameDepth depth = shaded(Rgb8Image(160, 120), assumed_camera(160, 120, 1.2));
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::failed);
  EXPECT_FALSE(depth.quality.reason.empty());
}

TEST(DepthVerdict, ARealFrameWithoutTruthIsNotTrusted) {
  const std::filesystem::path clip = shared_data("video/laparoscopy_720p_25fps.mp4");
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "real data is missing: " << clip;
  VideoReader reader(clip);
  StoredPicture frame;
  ASSERT_TRUE(reader.next(frame));
  const FrameDepth depth =
      shade_frame(prepare_frame(frame, assumed_camera(1280, 720, 1.22), {.halvings = 1}), {});
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
}

}  // namespace
}  // namespace organbake
