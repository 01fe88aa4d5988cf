// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/samples.h"

#include <atomic>
#include <mutex>

#include "drawing/splat.h"
#include "organbake/core/error.h"
#include "organbake/warp/warper.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

const Bundle& organ() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.map_size = 96;
    options.organ.lump_share = 0.03;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

// With a slot for each texel that has a face, in order.
MapDetail detail_of(CameraMaps maps, double focal_px) {
  for (std::uint32_t i = 0; i < maps.face.size(); ++i)
    if (maps.face[i] != kNoFace) maps.face[i] = i;
  return MapDetail(maps, focal_px, maps.face.size());
}

TEST(TexelOrder, UsesEveryConfidentTexelOnceInCompactRuns) {
  const CameraMaps& maps = organ().maps[0];
  const TexelOrder order = order_texels(maps);
  std::size_t wanted = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    wanted += maps.face[i] != kNoFace && maps.confidence[i] >= 0.5f / 255;
  }
  EXPECT_EQ(std::set(order.texels.begin(), order.texels.end()).size(), wanted);
  std::uint32_t next = 0;
  for (const TexelRun& run : order.runs) {
    EXPECT_EQ(run.first, next);
    EXPECT_GE(run.count, 1u);
    EXPECT_LE(run.count, kChunk);
    for (std::uint32_t i = run.first; i < run.first + run.count; ++i) {
      EXPECT_EQ(maps.face[order.texels[i]], run.face);
    }
    next += run.count;
  }
  EXPECT_EQ(next, order.texels.size());
}

TEST(SampleSet, EverySampleLiesWhereItsTexelWas) {
  const Bundle& bundle = organ();
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const CameraMaps& maps = bundle.maps[c];
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const auto rest = shell_matrices(bundle.proxy);
    const SampleSet set = build_sample_set(maps, camera, rest);
    const TexelOrder order = order_texels(maps);
    ASSERT_EQ(set.sample_count, order.texels.size());
    ASSERT_EQ(set.chunks.size(), order.runs.size());
    for (std::size_t r = 0; r < order.runs.size(); ++r) {
      for (std::uint32_t i = 0; i < order.runs[r].count; ++i) {
        const std::uint32_t texel = order.texels[order.runs[r].first + i];
        const std::size_t slot = r * kChunk + i;
        const std::array<float, 3> bound = set.bound(slot);
        const Eigen::Vector3d point =
            camera.camera_from_world *
            shell_point(rest[set.chunks[r].patch.face], bound[0], bound[1], bound[2]);
        const Eigen::Vector3d expected =
            double(maps.depth_mm[texel]) *
            unproject(camera.intrinsics,
                      {texel % maps.width + 0.5, double(texel / maps.width) + 0.5});
        constexpr double kFloatsMm = 1e-3;  // b and h are floats on prisms of some 40 mm
        ASSERT_LT((point - expected).norm(), kFloatsMm);
      }
    }
  }
}

TEST(SampleSet, PatchesBoundTheirSamples) {
  const SampleSet set =
      build_sample_set(organ().maps[1], organ().cameras.cameras[1], shell_matrices(organ().proxy));
  constexpr float kRounding = 1e-5f;
  for (std::size_t c = 0; c < set.chunks.size(); ++c) {
    const Chunk& chunk = set.chunks[c];
    for (std::size_t i = c * kChunk; i < c * kChunk + chunk.count; ++i) {
      const std::array<float, 3> at = set.bound(i);
      for (int k = 0; k < 3; ++k) {
        EXPECT_LE(std::abs(at[k] - chunk.patch.center[k]), chunk.patch.extent[k] + kRounding);
      }
    }
  }
}

// A flat map, facing the camera, of square-root light given by a formula of the column and row.
template <class Light>
CameraMaps flat_map(Light&& light) {
  CameraMaps maps;
  maps.width = maps.height = 8;
  maps.depth_mm.assign(64, 100);
  maps.height_mm.assign(64, 0);
  maps.face.assign(64, 0);
  maps.confidence.assign(64, 1);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const float s = light(x, y) / 255.0f;
      maps.color.emplace_back(s * s, s * s, s * s);
    }
  }
  return maps;
}

constexpr std::size_t kTexel = 3 * 8 + 4;  // row 3, column 4

std::uint32_t corner_byte(const TexelColors& texel, int corner, int channel) {
  return texel[corner] >> (8 * channel) & 255u;
}

TEST(TexelColors, OfARampAndAParabolaAreExactAtTheCorners) {
  CameraMaps maps =
      flat_map([](int x, int y) { return 20.0f + 6.0f * x + 2.0f * static_cast<float>(y * y); });
  for (Eigen::Vector3f& color : maps.color) color[2] = 0.25f;  // blue stays
  const TexelColors texel = detail_of(maps, 100).colors[kTexel];
  EXPECT_EQ(own_byte(texel, 0), 20u + 24 + 18);
  EXPECT_EQ(own_byte(texel, 2), 128u);
  EXPECT_EQ(own_byte(texel, 3), 255u);
  for (int corner = 0; corner < 4; ++corner) {
    const double x = corner % 2 ? 4.5 : 3.5, y = corner / 2 ? 3.5 : 2.5;
    EXPECT_NEAR(corner_byte(texel, corner, 1), 20 + 6 * x + 2 * y * y, 0.5);
    EXPECT_EQ(corner_byte(texel, corner, 2), 128u);
  }
}

// Whatever rows are worked on together.
TEST(TexelColors, RunOnFromTexelToTexel) {
  const CameraMaps& maps = organ().maps[1];
  const MapDetail all = detail_of(maps, organ().cameras.cameras[1].intrinsics.fx);
  int joined = 0;
  for (int y = 1; y + 1 < maps.height; ++y) {
    for (int x = 1; x + 1 < maps.width; ++x) {
      const std::size_t at = std::size_t(y) * maps.width + x;
      const auto one_surface = [&](std::size_t to) {
        return maps.face[to] != kNoFace && maps.confidence[to] > 0.1f &&
               std::abs(maps.depth_mm[to] - maps.depth_mm[at]) < 1;
      };
      bool all_round = true;
      for (int k = 0; k < 9; ++k)
        all_round &= one_surface(at + std::size_t(k / 3) * maps.width + k % 3 - maps.width - 1);
      if (!all_round) continue;
      ++joined;
      EXPECT_EQ(all.colors[at][1] & 0xffffffu, all.colors[at + 1][0] & 0xffffffu);
      EXPECT_EQ(all.colors[at][2] & 0xffffffu, all.colors[at + maps.width][0] & 0xffffffu);
    }
  }
  EXPECT_GT(joined, 100);
}

TEST(TexelColors, DoNotMixAcrossADepthEdge) {
  CameraMaps maps = flat_map([](int x, int) { return x < 4 ? 40.0f : 200.0f; });
  for (int y = 0; y < 8; ++y) {
    for (int x = 4; x < 8; ++x) maps.depth_mm[8 * y + x] = 150;
  }
  maps.depth_mm[2 * 8 + 2] = 99;
  const MapDetail all = detail_of(maps, 100);
  const std::size_t texel = 2 * 8 + 3;  // the last before the edge
  for (int corner = 0; corner < 4; ++corner)
    EXPECT_EQ(corner_byte(all.colors[texel], corner, 0), 40u);
  EXPECT_EQ(all.slope_u[texel], 1);  // from its left neighbour alone
}

TEST(TexelColors, ATexelAloneHasNoSlopeAndBackgroundIsNoNeighbour) {
  CameraMaps maps = flat_map([](int x, int) { return 20.0f + 10.0f * x; });
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (i == kTexel) continue;
    maps.face[i] = kNoFace;
    maps.depth_mm[i] = std::numeric_limits<float>::infinity();
  }
  const MapDetail all = detail_of(maps, 100);
  EXPECT_TRUE(std::isnan(all.slope_u[kTexel]));
  EXPECT_TRUE(std::isnan(all.slope_v[kTexel]));
  for (int corner = 0; corner < 4; ++corner)
    EXPECT_EQ(corner_byte(all.colors[kTexel], corner, 0), 60u);
}

TEST(PixelKey, KeepsDepthOffsetsAndSlot) {
  for (const float depth : {0.5f, 7.25f, 199.5f, 4000.0f}) {
    for (const float share : {-1.0f, -0.3f, 0.0f, 0.6f, 1.0f}) {
      for (const std::uint32_t slot : {0u, 77u, kMostSlots - 1}) {
        const std::uint32_t u = offset_bits(share), v = offset_bits(-share);
        const std::uint32_t high = key_high(depth, v), low = key_low(u, v, slot);
        EXPECT_NEAR(depth_of(high), depth, depth * 2e-6f);
        constexpr float kStep = 0.5f / 31 + 1e-6f;
        EXPECT_NEAR(offset_share(u_bits_of(low)), share, kStep);
        EXPECT_NEAR(offset_share(v_bits_of(high, low)), -share, kStep);
        EXPECT_EQ(slot_of(low), slot);
        EXPECT_LT(std::uint64_t(high) << 32 | low, kEmptyKey);
      }
    }
  }
  EXPECT_EQ(offset_share(offset_bits(0)), 0);
  EXPECT_TRUE(std::isinf(depth_of(static_cast<std::uint32_t>(kEmptyKey >> 32))));
  EXPECT_LT(key_high(99.9f, 63), key_high(100.1f, 0));
}

}  // namespace

// A warper that reads its cameras as views need them.
namespace {

const Bundle& late_organ() {
  static const Bundle bundle = make_synthetic_bundle({});
  return bundle;
}

// Hands out the organ's maps and remembers which were asked for.
struct Source {
  std::mutex mutex;
  std::multiset<std::size_t> asked;
  std::atomic<bool> broken{false};

  Warper::ReadMaps reader() {
    return [this](std::size_t camera) {
      const std::scoped_lock lock(mutex);
      asked.insert(camera);
      if (broken) throw BadDataError("cam: damaged");
      return late_organ().maps[camera];
    };
  }
};

Bundle without_maps() {
  Bundle frame = late_organ();
  for (CameraMaps& maps : frame.maps) maps = {};
  return frame;
}

TEST(LateCameras, AreReadWhenAViewNeedsThemAndOnce) {
  Source source;
  Warper late(without_maps(), source.reader()), early(late_organ());
  EXPECT_TRUE(source.asked.empty());
  Frame a, b;
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.4, -1, 0.3), {0.4, -1, 0.3}, {-1, 0.5, 0}}) {
    const View view = view_from(late_organ(), eye, 96);
    const DrawReport report = late.draw(late_organ().proxy.vertices, view, {}, a);
    early.draw(late_organ().proxy.vertices, view, {}, b);
    EXPECT_EQ(a.color.pixels, b.color.pixels);
    for (int i = 0; i < 3; ++i) {
      if (report.weights.weights[i] <= 0) continue;
      EXPECT_EQ(source.asked.count(report.weights.cameras[i]), 1u);
    }
  }
  EXPECT_LT(source.asked.size(), late_organ().maps.size());
}

TEST(LateCameras, AreAllReadOnceWhenReadAhead) {
  Source source;
  Warper warper(without_maps(), source.reader());
  warper.bind_ahead();
  warper.bind_ahead();
  warper.bind_all();  // beside the thread
  EXPECT_EQ(source.asked.size(), late_organ().maps.size());
  EXPECT_EQ(std::set(source.asked.begin(), source.asked.end()).size(), late_organ().maps.size());
}

TEST(LateCameras, ADamagedOneIsSaidByTheViewThatNeedsItAndTriedAgain) {
  Source source;
  source.broken = true;
  Warper warper(without_maps(), source.reader());
  warper.bind_ahead();  // fails quietly
  const View view = view_from(late_organ(), {0.4, -1, 0.3}, 96);
  Frame frame;
  EXPECT_THROW(warper.draw(late_organ().proxy.vertices, view, {}, frame), BadDataError);
  source.broken = false;
  EXPECT_GT(warper.draw(late_organ().proxy.vertices, view, {}, frame).sample_pixels, 0u);
}

// What was posed for a picture that failed is drawn anew where the last one was whole.
TEST(LateCameras, APictureAfterOneThatFailedIsOfTheOrganAsItLies) {
  Source source;
  Warper warper(without_maps(), source.reader());
  const View view = view_from(late_organ(), {0.4, -1, 0.3}, 96);
  Frame frame;
  warper.draw(late_organ().proxy.vertices, view, {}, frame);
  const auto dent = dented(late_organ().proxy, {0.4, -1, 0.3}, 10);
  source.broken = true;
  Frame other, expected;
  EXPECT_THROW(warper.draw(dent, view_from(late_organ(), {-1, 0.5, 0}, 96), {}, other),
               BadDataError);
  source.broken = false;
  Warper(late_organ()).draw(dent, view, {}, expected);
  warper.draw(dent, view, {}, frame);
  EXPECT_EQ(frame.color.pixels, expected.color.pixels);
}

}  // namespace
}  // namespace organbake
