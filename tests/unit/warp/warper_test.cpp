// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/warper.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/paper_warp.h"
#include "placing/placing.h"
#include "support/meshes.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

struct Drawing {
  Frame frame;
  DrawReport report;
};

Drawing drawing(const Bundle& bundle, const View& view, int threads,
                const DrawOptions& options = on_black()) {
  const ThreadLimit limit(threads);
  Warper warper(bundle);
  Drawing drawing;
  drawing.report = warper.draw(bundle.proxy.vertices, view, options, drawing.frame);
  return drawing;
}

Frame drawn(const Bundle& bundle, const View& view, int threads = 2) {
  return drawing(bundle, view, threads).frame;
}

// The map of camera 0 as a picture, and where that camera saw the skin well.
struct MapPicture {
  Rgb8Image color;
  std::vector<std::uint8_t> well_seen;
};

MapPicture picture_of_map() {
  const CameraMaps& maps = organ_to_play().maps[0];
  MapPicture picture{Rgb8Image(maps.width, maps.height), {}};
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    picture.well_seen.push_back(maps.face[i] != kNoFace && maps.confidence[i] > 0.9f);
    for (int c = 0; c < 3; ++c)
      picture.color.pixels[3 * i + c] = srgb8_from_linear(maps.color[i][c]);
  }
  return picture;
}

TEST(Warper, AtACamerasPoseShowsThatCamerasMap) {
  const View view{organ_to_play().cameras.cameras[0], 1};
  const Frame frame = drawn(organ_to_play(), view);
  const auto [expected, inside] = picture_of_map();
  // Samples land on their own texels' centres: what is left is 8-bit rounding.
  constexpr double kRoundTripDb = 45;
  EXPECT_GT(compare_images(frame.color, expected, inside).psnr_db, kRoundTripDb);
}

TEST(Warper, GivesTheSameBytesForAnyNumberOfThreads) {
  const View view = view_from(organ_to_play(), {0.4, -1, 0.3}, 300);
  const Drawing one = drawing(organ_to_play(), view, 1);
  for (const int threads : {2, 3, 16}) {  // more of them, more parts of tiles
    const Drawing several = drawing(organ_to_play(), view, threads);
    EXPECT_EQ(one.frame.color.pixels, several.frame.color.pixels) << threads;
    EXPECT_EQ(one.frame.cover, several.frame.cover) << threads;
    EXPECT_EQ(one.report.base_triangles, several.report.base_triangles) << threads;
    EXPECT_EQ(one.report.samples_drawn, several.report.samples_drawn) << threads;
  }
}

TEST(Warper, MeasuresWorkAndItsLongestChainWhenAsked) {
  const View view = view_from(organ_to_play(), {0.4, -1, 0.3}, 300);
  DrawOptions measured = on_black();
  measured.measure = true;
  const DrawReport report = drawing(organ_to_play(), view, 16, measured).report;
  EXPECT_GT(report.times.splat, 0);
  EXPECT_GT(report.critical_path.splat, 0);
  EXPECT_LT(report.critical_path.total(), report.times.total());
  const DrawReport unmeasured = drawing(organ_to_play(), view, 16).report;
  EXPECT_EQ(unmeasured.times.total(), 0);
  EXPECT_EQ(unmeasured.critical_path.total(), 0);
}

// A frame after another of the same view draws the tiles that moved alone; byte for byte it is the
// frame that a new warper draws.
TEST(Warper, AFrameThatContinuesTheLastOneHasTheSameBytes) {
  const Bundle& organ = organ_to_play();
  const View view = view_from(organ, {0.4, -1, 0.3}, 640);
  const auto rest = organ.proxy.vertices;
  auto one_moved = rest;  // and with it the faces round its neighbours, whose normals turn
  one_moved[0] += Eigen::Vector3d(0, 0, 4);
  DrawOptions with_tool = on_black();
  with_tool.solids = {{.from = rest[0], .to = rest[0] + Eigen::Vector3d(0, -60, 0)}};
  DrawOptions other_tool = with_tool;
  other_tool.solids[0].to.x() += 20;
  Warper warper(organ);
  Frame frame;
  int kept = 0;
  const auto expect_as_new = [&](const std::vector<Eigen::Vector3d>& positions,
                                 const DrawOptions& options) {
    Warper fresh(organ);
    Frame expected;
    const DrawReport a = warper.draw(positions, view, options, frame);
    const DrawReport b = fresh.draw(positions, view, options, expected);
    EXPECT_EQ(frame.color.pixels, expected.color.pixels);
    EXPECT_EQ(frame.cover, expected.cover);
    EXPECT_EQ(frame.depth_mm, expected.depth_mm);
    EXPECT_EQ(a.sample_pixels, b.sample_pixels);
    EXPECT_EQ(a.base_pixels, b.base_pixels);
    EXPECT_EQ(a.filled_pixels, b.filled_pixels);
    kept += a.tiles_kept;
  };
  for (const auto& positions :
       {rest, one_moved, dented(organ.proxy, {0, -1, 0}, 15), one_moved, rest})
    expect_as_new(positions, on_black());
  for (const auto& options : {with_tool, other_tool, with_tool, on_black()}) {
    expect_as_new(rest, options);
    expect_as_new(one_moved, options);
  }
  EXPECT_GT(kept, 0);
}

TEST(Warper, LeavesNoHolesAtRestOrDented) {
  Warper warper(organ_to_play());
  Frame frame;
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(0.4, -1, 0.3), Eigen::Vector3d(-1, 0.2, -0.5), Eigen::Vector3d(1, 1, 1)}) {
    const View view = view_from(organ_to_play(), d, 256);
    for (const auto& positions :
         {organ_to_play().proxy.vertices, dented(organ_to_play().proxy, d, 15)}) {
      warper.draw(positions, view, on_black(), frame);
      EXPECT_EQ(holes_in(frame), 0u);
    }
  }
}

TEST(Warper, TwoEyesTurnAboutAreLeftAloneUntilTheOrganMoves) {
  Warper warper(organ_to_play());
  const std::array<View, 2> views = {view_from(organ_to_play(), {0.4, -1, 0.3}, 100),
                                     view_from(organ_to_play(), {0.45, -1, 0.3}, 100)};
  std::array<Frame, 2> frames;
  const auto unchanged = [&](const std::vector<Eigen::Vector3d>& positions) {
    std::array<bool, 2> kept;
    for (std::size_t eye : {0, 1})
      kept[eye] = warper.draw(positions, views[eye], on_black(), frames[eye]).unchanged;
    return kept[0] == kept[1] ? std::optional(kept[0]) : std::nullopt;
  };
  EXPECT_EQ(unchanged(organ_to_play().proxy.vertices), false);
  EXPECT_EQ(unchanged(organ_to_play().proxy.vertices), true);
  const auto dent = dented(organ_to_play().proxy, {0, -1, 0}, 5);
  EXPECT_EQ(unchanged(dent), false);
  EXPECT_EQ(unchanged(dent), true);
  for (std::size_t eye : {0, 1}) {
    Frame anew;
    Warper(organ_to_play()).draw(dent, views[eye], on_black(), anew);
    EXPECT_EQ(frames[eye].color.pixels, anew.color.pixels);
  }
}

TEST(Warper, AMirroredOrganGivesAMirroredFrame) {
  SyntheticOptions options = organ_options();
  options.organ.mirrored = true;
  const Bundle mirrored = make_synthetic_bundle(options);
  const Frame right = drawn(organ_to_play(), view_from(organ_to_play(), {0.3, -1, 0.2}, 160));
  const Frame left = drawn(mirrored, view_from(mirrored, {-0.3, -1, 0.2}, 160));
  Rgb8Image flipped(160, 160);
  std::vector<std::uint8_t> both(160 * 160, 0);
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 160; ++x) {
      std::copy_n(left.color.at(159 - x, y), 3, flipped.at(x, y));
      both[y * 160 + x] = right.covered(x, y) && left.covered(159 - x, y);
    }
  }
  // Texels and splats fall on other sides of pixel borders: alike to the eye, not to the bit.
  constexpr double kAlikeDb = 26;
  EXPECT_GT(compare_images(right.color, flipped, both).psnr_db, kAlikeDb);
  EXPECT_LT(compare_images(right.color, left.color, both).psnr_db, kAlikeDb - 3);
}

TEST(Warper, ATinyTurnIsATinyChange) {
  Warper warper(organ_to_play());
  Frame last, now;
  constexpr double kStep = 0.0017;  // 0.1°
  warper.draw(organ_to_play().proxy.vertices, view_from(organ_to_play(), {0, -1, 0.1}, 128),
              on_black(), last);
  for (int i = 1; i <= 120; ++i) {
    const double angle = 10 * i * kStep;
    const Eigen::Vector3d before(std::sin(angle), -std::cos(angle), 0.1),
        after(std::sin(angle + kStep), -std::cos(angle + kStep), 0.1);
    warper.draw(organ_to_play().proxy.vertices, view_from(organ_to_play(), before, 128), on_black(),
                last);
    warper.draw(organ_to_play().proxy.vertices, view_from(organ_to_play(), after, 128), on_black(),
                now);
    std::vector<std::uint8_t> both(128 * 128);
    for (std::size_t p = 0; p < both.size(); ++p) {
      both[p] = last.cover[p] != Cover::background && now.cover[p] != Cover::background;
    }
    // 0.1° moves the skin by a tenth of a pixel; a camera that popped in would show as whole
    // levels.
    EXPECT_LT(compare_images(last.color, now.color, both).mean_abs, 3) << i;
  }
}

Frame paper_frame(const View& view, const std::vector<Eigen::Vector3d>& positions,
                  int threads = 2) {
  const ThreadLimit limit(threads);
  Frame frame;
  PaperWarp(organ_to_play()).draw(positions, view, on_black(), frame);
  return frame;
}

TEST(PaperWarp, AtACamerasPoseShowsThatCamerasMap) {
  const View view{organ_to_play().cameras.cameras[0], 1};
  const Frame frame = paper_frame(view, organ_to_play().proxy.vertices);
  auto [expected, inside] = picture_of_map();
  std::size_t seen = 0, drawn = 0;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    seen += inside[i];
    drawn += inside[i] &= frame.cover[i] == Cover::samples;
  }
  // At rest every pixel looks itself up, but for the proxy's snapping to 1/256 px.
  constexpr double kRoundTripDb = 40;
  EXPECT_GT(compare_images(frame.color, expected, inside).psnr_db, kRoundTripDb);
  EXPECT_GT(drawn, seen * 9 / 10);  // the rest lies beyond the outline of 80 flat faces
}

TEST(PaperWarp, FollowsTheProxy) {
  const View view = view_from(organ_to_play(), {0.4, -1, 0.3}, 300);
  // A translation: the truth is the organ at rest, seen from as far beside.
  const Eigen::Vector3d shift(3, 0, 2);
  auto moved = organ_to_play().proxy.vertices;
  for (auto& v : moved) v += shift;
  View moved_view = view;
  moved_view.camera.camera_from_world.translation -= view.camera.camera_from_world.rotation * shift;
  const Frame at_rest = paper_frame(view, organ_to_play().proxy.vertices);
  const Frame carried = paper_frame(moved_view, moved);
  // The cameras stay where they are, so texels fall elsewhere: a resampling apart.
  constexpr double kResampledDb = 28;
  EXPECT_GT(compare_images(at_rest.color, carried.color).psnr_db, kResampledDb);
}

TEST(PaperWarp, GivesTheSameBytesForAnyNumberOfThreads) {
  const View view = view_from(organ_to_play(), {0.4, -1, 0.3}, 200);
  const auto positions = dented(organ_to_play().proxy, {0, -1, 0}, 10);
  EXPECT_EQ(paper_frame(view, positions, 1).color.pixels,
            paper_frame(view, positions, 3).color.pixels);
}

TEST(PaperWarp, NeedsMapsAndPositions) {
  Bundle without = organ_to_play();
  without.maps.clear();
  EXPECT_THROW(PaperWarp{without}, UsageError);
  Frame frame;
  const View view = view_from(organ_to_play(), {0.4, -1, 0.3}, 64);
  const PaperWarp paper(organ_to_play());
  const std::vector<Eigen::Vector3d> none;
  EXPECT_THROW(paper.draw(none, view, {}, frame), BadDataError);
  DrawOptions telling;
  telling.keep_bound = true;
  EXPECT_THROW(paper.draw(organ_to_play().proxy.vertices, view, telling, frame), UsageError);
}

// Over a ball of 40 mm, by nodes about 3 mm apart: skin rises along the ridge, comes nearer from
// its sides, and stays where it was beyond and on the ball's other side.
TEST(PosedShell, JawsDrawSkinTogetherIntoAFold) {
  const TriangleMesh ball = sphere_mesh(40, 3);
  PosedShell shell(ShellSurface(ball, flat_skin(ball, 2)));
  const std::vector<ShellMatrix> rest = shell.matrices();
  const SkinFold fold{{0, 0, 40}, {1, 0, 0}, {0, 0, 1}, 6, 1};
  EXPECT_TRUE(shell.pose(ball.vertices, {fold}));
  EXPECT_FALSE(shell.pose(ball.vertices, {fold}));
  double highest_mm = 0;
  for (std::size_t f = 0; f < rest.size(); ++f) {
    const Eigen::Vector3d from = rest[f].col(0), to = shell.matrices()[f].col(0), way = to - from;
    highest_mm = std::max(highest_mm, to.z() - 40);
    if ((from - fold.middle_mm).norm() < 6) {
      EXPECT_GE(way.z(), 0);
      EXPECT_LE(std::abs(to.y()), (std::abs(from.x()) < 2 ? 0.5 : 0.7) * std::abs(from.y()));
      EXPECT_NEAR(way.x(), 0, 1e-12);
    }
    if ((from - fold.middle_mm).norm() > 24) {
      EXPECT_EQ(way.norm(), 0);
    }
  }
  EXPECT_GT(highest_mm, 5);
  EXPECT_LT(highest_mm, 7.5);
  EXPECT_TRUE(shell.pose(ball.vertices, {}));
  for (std::size_t f = 0; f < rest.size(); ++f)
    EXPECT_LT((shell.matrices()[f] - rest[f]).norm(), 1e-9);
}

}  // namespace
}  // namespace organbake
