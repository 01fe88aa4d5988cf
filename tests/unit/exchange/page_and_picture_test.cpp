// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/exchange.h"

#include <libdeflate.h>

#include "organ_to_export.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

std::vector<std::byte> inflated(std::span<const std::byte> pack, const PackPart& part) {
  std::vector<std::byte> bytes(part.bytes);
  libdeflate_decompressor* const decompressor = libdeflate_alloc_decompressor();
  const auto result =
      libdeflate_gzip_decompress(decompressor, pack.data() + part.offset, part.packed_bytes,
                                 bytes.data(), bytes.size(), nullptr);
  libdeflate_free_decompressor(decompressor);
  EXPECT_EQ(result, LIBDEFLATE_SUCCESS);
  return bytes;
}

Bundle through_pack(const Bundle& bundle) {
  const auto pack = web_pack(bundle);
  const auto parts = contents_of_pack(pack, pack.size());
  Bundle again = unpacked_frame(inflated(pack, parts[0]));
  for (std::size_t c = 0; c < again.maps.size(); ++c)
    again.maps[c] = decoded_maps(inflated(pack, parts[1 + c]), again.cameras.cameras[c].intrinsics,
                                 shell_face_count(again), "maps");
  return again;
}

Rgb8Image drawn(Bundle bundle) {
  Player player(std::move(bundle));
  Frame frame;
  player.draw(orbit_view(player.bundle().cameras, {0.3, 0.2}, 320, 240), {}, frame);
  return frame.color;
}

TEST(WebPack, ShowsTheOrganAsTheBundleDoes) {
  const Rgb8Image own = drawn(organ_to_export()), packed = drawn(through_pack(organ_to_export()));
  double squares = 0;
  for (std::size_t i = 0; i < own.pixels.size(); ++i)
    squares += std::pow(own.pixels[i] - packed.pixels[i], 2);
  const double psnr_db =
      10 * std::log10(255.0 * 255 * static_cast<double>(own.pixels.size()) / squares);
  EXPECT_GT(psnr_db, 55);  // what the page is promised for, its arithmetic included
}

TEST(WebPack, IsTheSameEveryTime) {
  EXPECT_EQ(web_pack(organ_to_export()), web_pack(organ_to_export()));
}

TEST(WebPage, HoldsEverythingAndNothingOfATemplate) {
  Bundle bundle = organ_to_export();
  bundle.manifest.name = "a <b> & {{pack}}";
  WebPlayer player{
      "<title>{{title}}</title>{{style}}{{loader}}{{script}}{{module}}|{{pack}}|{{provenance}}",
      "S{{x}}",
      "L;  // l\n  // licence\n\n  M(\"//\");\n",
      "J",
      {},
      {}};
  player.module.assign(1000, std::byte{7});
  const std::string page = web_page(bundle, player);
  EXPECT_THAT(page,
              testing::StartsWith(
                  "<title>a &lt;b&gt; &amp; {{pack}}</title>S{{x}}L;  // l\nM(\"//\");\nJH4sI"));
  EXPECT_GT(page.size(), 100'000u);
}

TEST(WebPage, SaysHowTheModuleIsBuilt) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_web_player(folder.path()); }),
              testing::HasSubstr("scripts/build web"));
}

class CutOutTest : public testing::Test {
 protected:
  // By formula: whether a place of the picture shows the organ, and how deep.
  double true_depth(std::size_t c, double x, double y) const {
    const PosedCamera& camera = bundle_.cameras.cameras[c];
    return export_options().organ.trace(
        camera.center_world_mm(),
        camera.camera_from_world.rotation.transpose() * unproject(camera.intrinsics, {x, y}));
  }
  CutOut picture(std::size_t c) const {
    return cut_out(bundle_.maps[c], bundle_.cameras.cameras[c], base_, scene_);
  }

  const Bundle& bundle_ = organ_to_export();
  TriangleMesh base_ = base_surface(bundle_);
  RayScene scene_{base_};
};

TEST_F(CutOutTest, TheBaseLayersSurfaceIsTheOrgans) {
  EXPECT_TRUE(analyse_topology(base_).closed_manifold());
  EXPECT_GT(signed_volume(base_), 0);
  constexpr double kStored_mm = 1e-4;  // heights are floats
  for (const Eigen::Vector3d& vertex : base_.vertices)
    ASSERT_LT(off_surface_mm(vertex), kStored_mm);
}

TEST_F(CutOutTest, MasksAreTheOrgansOutline) {
  for (std::size_t c = 0; c < 3; ++c) {
    const CutOut cut = picture(c);
    double both = 0, either = 0;
    for (int y = 0; y < cut.color.height; ++y)
      for (int x = 0; x < cut.color.width; ++x) {
        const bool there = std::isfinite(true_depth(c, x + 0.5, y + 0.5));
        const bool masked = cut.alpha[std::size_t(y) * cut.color.width + x] >= 128;
        both += there && masked;
        either += there || masked;
      }
    EXPECT_GT(both / either, 0.995);
  }
}

TEST_F(CutOutTest, AlphaIsTheShareThatTheOrganCovers) {
  const CutOut cut = picture(1);
  constexpr int kSide = 16;
  double squares = 0;
  int rim = 0;
  for (int y = 0; y < cut.color.height; ++y)
    for (int x = 0; x < cut.color.width; ++x) {
      const double alpha = cut.alpha[std::size_t(y) * cut.color.width + x] / 255.0;
      if (alpha == 0 || alpha == 1) continue;
      int covered = 0;
      for (int r = 0; r < kSide * kSide; ++r)
        covered += std::isfinite(
            true_depth(1, x + (r % kSide + 0.5) / kSide, y + (r / kSide + 0.5) / kSide));
      squares += std::pow(alpha - covered / double(kSide * kSide), 2);
      ++rim;
    }
  ASSERT_GT(rim, 300);
  EXPECT_LT(std::sqrt(squares / rim), 0.05) << "16 rays tell 0.03, the base layer's chords more";
}

TEST_F(CutOutTest, ColoursAndDepthsAreTheMaps) {
  const CutOut cut = picture(0);
  const CameraMaps& maps = bundle_.maps[0];
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace || cut.alpha[i] == 0) continue;
    ASSERT_EQ(cut.depth_mm[i], maps.depth_mm[i]);
    for (int k = 0; k < 3; ++k)
      ASSERT_EQ(cut.color.pixels[3 * i + k], srgb8_from_linear(maps.color[i][k]));
  }
}

TEST(DepthUnit, IsTheFinestRoundOneThatFits) {
  EXPECT_DOUBLE_EQ(depth_unit_mm(655.35), 0.01);
  EXPECT_DOUBLE_EQ(depth_unit_mm(656), 0.02);
  EXPECT_DOUBLE_EQ(depth_unit_mm(2000), 0.05);
  EXPECT_DOUBLE_EQ(depth_unit_mm(3300), 0.1);
}

TEST(DepthPicture, HoldsWholeCountsIn16Bits) {
  CutOut cut;
  cut.color = Rgb8Image(3, 1);
  cut.depth_mm = {0, 123.4f, 655.35f};
  const TemporaryFolder folder;
  const std::string bytes = depth_png(cut, 0.01);
  const StoredPicture read =
      parse_png(std::as_bytes(std::span(bytes.data(), bytes.size())), "depth");
  ASSERT_FALSE(read.linear.empty()) << "16 bits";
  EXPECT_EQ(read.linear[0], 0);
  EXPECT_NEAR(srgb_from_linear(read.linear[3]) * 65535, 12340, 0.5);
  EXPECT_NEAR(srgb_from_linear(read.linear[6]) * 65535, 65535, 0.5);
}

TEST(SurfacePoints, LieOnTheOrganInItsColours) {
  const std::vector<SparsePoint> points = surface_points(organ_to_export(), 1);
  EXPECT_GT(points.size(), 10000u);
  constexpr double kOnSurface_mm = 0.01;  // a depth is a float, seen at up to 80°
  double worst_mm = 0, worst_color = 0;
  for (const SparsePoint& point : points) {
    worst_mm = std::max(worst_mm, off_surface_mm(point.place_mm));
    const Eigen::Vector3f color = export_options().organ.color(point.place_mm);
    for (int k = 0; k < 3; ++k)
      worst_color =
          std::max<double>(worst_color, std::abs(point.srgb[k] - srgb8_from_linear(color[k])));
  }
  EXPECT_LT(worst_mm, kOnSurface_mm);
  EXPECT_LE(worst_color, 1) << "one ray a texel: the texel's colour is the place's own";
}

TEST(SurfacePoints, AreSeenWhereNothingHidesThem) {
  const Bundle& bundle = organ_to_export();
  std::size_t sightings = 0, hidden = 0;
  for (const SparsePoint& point : surface_points(bundle, 4)) {
    EXPECT_GE(point.seen.size(), 1u);
    for (const SparsePoint::Sighting& seen : point.seen) {
      const PosedCamera& camera = bundle.cameras.cameras[seen.image];
      EXPECT_LT((project(camera, point.place_mm) - seen.pixel).norm(), 1e-9);
      const Eigen::Vector3d eye = camera.center_world_mm();
      const double to_skin = export_options().organ.trace(eye, point.place_mm - eye);
      ++sightings;
      hidden += to_skin < 0.98;  // 5 mm of about 250 before it
    }
  }
  EXPECT_GT(sightings, 1000u);
  EXPECT_LT(double(hidden), 0.001 * double(sightings)) << "half a texel at an edge decides";
}

TEST(SurfacePoints, AreNoMoreThanWanted) {
  const std::size_t all = surface_points(organ_to_export(), 2).size();
  const std::size_t few = surface_points(organ_to_export(), 2, 2000).size();
  EXPECT_GT(all, 4000u);
  EXPECT_LE(few, 2000u);
  EXPECT_GT(few, 1000u) << "the grid is coarsened no more than it takes";
}

}  // namespace
}  // namespace organbake
