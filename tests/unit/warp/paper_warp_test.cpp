// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/paper_warp.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "support/synthetic_bundle.h"
#include "views_round.h"

namespace organbake {
namespace {

const Bundle& paper_organ() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.organ.lump_share = 0.05;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

Frame paper_frame(const View& view, const std::vector<Eigen::Vector3d>& positions,
                  int threads = 2) {
  const ThreadLimit limit(threads);
  DrawOptions options;
  options.background = {0, 0, 0};
  Frame frame;
  PaperWarp(paper_organ()).draw(paper_organ(), positions, view, options, frame);
  return frame;
}

TEST(PaperWarp, AtACamerasPoseShowsThatCamerasMap) {
  const View view{paper_organ().cameras.cameras[0], 1};
  const Frame frame = paper_frame(view, paper_organ().proxy.vertices);
  const CameraMaps& maps = paper_organ().maps[0];
  Rgb8Image expected(maps.width, maps.height);
  std::vector<std::uint8_t> inside(maps.face.size(), 0);
  std::size_t seen = 0, drawn = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    const bool well_seen = maps.face[i] != kNoFace && maps.confidence[i] > 0.9f;
    inside[i] = well_seen && frame.cover[i] == Cover::samples;
    seen += well_seen, drawn += inside[i];
    for (int c = 0; c < 3; ++c) expected.pixels[3 * i + c] = srgb8_from_linear(maps.color[i][c]);
  }
  // At rest every pixel looks itself up, but for the proxy's snapping to 1/256 px.
  constexpr double kRoundTripDb = 40;
  EXPECT_GT(compare_images(frame.color, expected, inside).psnr_db, kRoundTripDb);
  EXPECT_GT(drawn, seen * 9 / 10);  // the rest lies beyond the outline of 80 flat faces
}

TEST(PaperWarp, FollowsTheProxy) {
  const View view = view_from(paper_organ(), {0.4, -1, 0.3}, 300);
  // A translation: the truth is the organ at rest, seen from as far beside.
  const Eigen::Vector3d shift(3, 0, 2);
  auto moved = paper_organ().proxy.vertices;
  for (auto& v : moved) v += shift;
  View moved_view = view;
  moved_view.camera.camera_from_world.translation -= view.camera.camera_from_world.rotation * shift;
  const Frame at_rest = paper_frame(view, paper_organ().proxy.vertices);
  const Frame carried = paper_frame(moved_view, moved);
  // The cameras stay where they are, so texels fall elsewhere: a resampling apart.
  constexpr double kResampledDb = 28;
  EXPECT_GT(compare_images(at_rest.color, carried.color).psnr_db, kResampledDb);
}

TEST(PaperWarp, GivesTheSameBytesForAnyNumberOfThreads) {
  const View view = view_from(paper_organ(), {0.4, -1, 0.3}, 200);
  const auto positions = dented(paper_organ().proxy, {0, -1, 0}, 10);
  EXPECT_EQ(paper_frame(view, positions, 1).color.pixels,
            paper_frame(view, positions, 3).color.pixels);
}

TEST(PaperWarp, NeedsMapsAndPositions) {
  Bundle without = paper_organ();
  without.maps.clear();
  EXPECT_THROW(PaperWarp{without}, UsageError);
  Frame frame;
  const View view = view_from(paper_organ(), {0.4, -1, 0.3}, 64);
  EXPECT_THROW(PaperWarp(paper_organ()).draw(paper_organ(), {}, view, {}, frame), BadDataError);
}

}  // namespace
}  // namespace organbake
