// SPDX-License-Identifier: GPL-3.0-or-later
// Random chunks over one face, near and far: however a tile cuts them, a pixel gets the same key.
#include "drawing/splat.h"

#include "drawing/tile_drawing.h"
#include "organbake/core/random.h"
#include "organbake/warp/view.h"
#include "picture/spans.h"
#include "placing/placing.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr PixelBox kSplatTile{0, 0, TileGrid::kWidth, TileGrid::kHeight};
constexpr float kNear_mm = 1, kTie_mm = 0.3f;

View tile_view() {
  View view;
  view.camera.intrinsics = {kSplatTile.x1, kSplatTile.y1, 300, 300, 128, 64};
  view.near_mm = kNear_mm;
  return view;
}

struct Scene {
  View view = tile_view();
  FaceFrame face;
  SampleSet set;  // one chunk
  ChunkFrame chunk;

  explicit Scene(RandomStream& random, std::uint32_t count, bool large) {
    const auto about = [&](double reach) { return random.uniform(-reach, reach); };
    TriangleMesh mesh;
    mesh.faces = {{0, 1, 2}};
    const Eigen::Vector3d middle(about(20), about(10), random.uniform(30, 200));
    for (int i = 0; i < 3; ++i)
      mesh.vertices.push_back(middle + Eigen::Vector3d(about(20), about(20), about(20)));
    PlacedFaces faces;
    faces.place(PosedShell(ShellSurface(mesh)), view, 1, false);
    face = faces[0];
    face.two_sided = true;
    if (random.below(2) == 0) bend(random);
    Chunk one;
    one.count = count;
    const double extent = std::pow(10, random.uniform(-2.5, -1));
    one.patch.center[0] = static_cast<float>(random.uniform(0, 0.5));
    one.patch.center[1] = static_cast<float>(random.uniform(0, 0.5));
    one.patch.extent[0] = one.patch.extent[1] = static_cast<float>(extent);
    one.patch.extent[2] = static_cast<float>(random.uniform(0, 0.3));
    const double texel = large ? random.uniform(0.1, 1.5) : extent / 4;
    one.patch.along_u[0] = one.patch.along_v[1] = static_cast<float>(texel);
    set.chunks = {one};
    set.colors.assign(kChunk, {});
    for (auto* place : {&set.b1, &set.b2, &set.h}) {
      place->assign(kChunk, 0);
      for (std::uint32_t i = 0; i < count; ++i)
        (*place)[i] = static_cast<PatchCoordinate>(about(kFullCoordinate));
    }
    place_patches(PatchTable(std::span(&one.patch, 1)), 0, 1, std::span(&face, 1), view, &chunk);
  }

  // As a deep poke bends it.
  void bend(RandomStream& random) {
    const Intrinsics& k = view.camera.intrinsics;
    for (int column = 6; column < 9; ++column) {
      for (int axis = 0; axis < 3; ++axis)
        face.metric(axis, column) = static_cast<float>(random.uniform(-10, 10));
    }
    Eigen::Matrix4f projection = Eigen::Matrix4f::Identity();
    projection(0, 0) = static_cast<float>(k.fx), projection(0, 2) = static_cast<float>(k.cx);
    projection(1, 1) = static_cast<float>(k.fy), projection(1, 2) = static_cast<float>(k.cy);
    face.pixel = projection * face.metric;
  }

  TileKeys keys(const PixelBox& part) const {
    TileKeys keys;
    keys.clear(kSplatTile, part);
    splat_chunk(set, 0, chunk, face, kNear_mm, kTie_mm, keys);
    return keys;
  }
};

std::uint64_t key_at(const TileKeys& keys, int x, int y) { return keys.row(y)[x - keys.box.x0]; }

// Calls visit(scene) for as many scenes with chunks that are drawn.
template <class Visit>
void for_scenes(int count, const Visit& visit) {
  RandomStream random(7);
  const std::array<std::uint32_t, 7> counts = {1, 8, 15, 16, 17, 63, 64};
  for (int i = 0; count > 0; ++i) {
    const Scene scene(random, counts[i % counts.size()], i % 2 == 1);
    if (scene.chunk.visibility != ChunkVisibility::drawn) continue;
    visit(scene, random);
    --count;
  }
}

TEST(Splat, APartOfATileGetsTheKeysOfTheWhole) {
  for_scenes(1500, [&](const Scene& scene, RandomStream& random) {
    const int x0 = 32 * static_cast<int>(random.below(kSplatTile.x1 / 32)),
              y0 = 32 * static_cast<int>(random.below(kSplatTile.y1 / 32));
    const PixelBox part{x0, y0, x0 + 32, y0 + 64 < kSplatTile.y1 ? y0 + 64 : kSplatTile.y1};
    const TileKeys whole = scene.keys(kSplatTile), own = scene.keys(part);
    for (int y = part.y0; y < part.y1; ++y) {
      for (int x = part.x0; x < part.x1; ++x)
        ASSERT_EQ(key_at(own, x, y), key_at(whole, x, y)) << x << ',' << y;
    }
  });
}

// Flat faces and bent ones: in the pixel, and as deep, as the shell map says of each sample.
TEST(Splat, SamplesLandWhereTheShellMapPutsThem) {
  constexpr double kFloat_px = 0.01, kFloatShare = 1e-4;
  std::size_t landed = 0;
  for_scenes(600, [&](const Scene& scene, RandomStream&) {
    const TileKeys keys = scene.keys(kSplatTile);
    PlacedSamples placed;
    place_samples(scene.set, 0, scene.chunk, scene.face, kNear_mm, keys, kAnySplat, placed);
    const ShellMatrix shell = scene.face.metric.topRows<3>().cast<double>();
    const Intrinsics& k = scene.view.camera.intrinsics;
    for (int i = 0; i < placed.count; ++i) {
      const auto [b1, b2, h] = scene.set.bound(placed.sample[i]);
      const Eigen::Vector3d p = shell_point(shell, b1, b2, h);
      if (p.z() < 2 * kNear_mm) continue;  // nearer, rounding moves whole pixels
      const Eigen::Vector2d at = project(k, p);
      const double column = kAnySplat.column(placed.cell[i]) + 0.5 * scene.chunk.columns,
                   row = kAnySplat.row(placed.cell[i]) + 0.5 * scene.chunk.rows;
      if (!(at.cwiseAbs().maxCoeff() < 400)) continue;  // held at the guard band's end
      ASSERT_NEAR(placed.z[i], p.z(), kFloatShare * p.z());
      ASSERT_NEAR(column, at.x(), 0.5 + kFloat_px);
      ASSERT_NEAR(row, at.y(), 0.5 + kFloat_px);
      ++landed;
    }
  });
  EXPECT_GT(landed, 2000u);
}

TEST(Splat, NothingIsDrawnOutsideTheChunksBox) {
  std::size_t drawn = 0;
  for_scenes(800, [&](const Scene& scene, RandomStream&) {
    const TileKeys keys = scene.keys(kSplatTile);
    const PixelBox& box = scene.chunk.box;
    for (int y = kSplatTile.y0; y < kSplatTile.y1; ++y) {
      for (int x = kSplatTile.x0; x < kSplatTile.x1; ++x) {
        if (key_at(keys, x, y) == kEmptyKey) continue;
        ++drawn;
        ASSERT_TRUE(x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1);
      }
    }
  });
  EXPECT_GT(drawn, 10000u);
}

// Rounding then puts samples hundreds of pixels off their chunk's box, or nowhere.
TEST(Splat, AbsurdPlacesStayWithinTheGuardBand) {
  for (const double far_mm : {1e7, 1e9, 1e15, 1e37}) {
    RandomStream random(3);
    for (int i = 0; i < 200; ++i) {
      Scene scene(random, 64, false);
      scene.face.pixel.col(0).array() += static_cast<float>(random.uniform(-far_mm, far_mm));
      scene.face.pixel.col(3).array() *= static_cast<float>(far_mm);
      ChunkFrame& chunk = scene.chunk;
      chunk.visibility = ChunkVisibility::drawn;
      chunk.box = {100, 50, 120, 60};
      chunk.columns = chunk.rows = TileKeys::kGuard;
      scene.keys(kSplatTile);  // the sanitizers look on
    }
  }
}

constexpr int kTiledWidth = 400, kTiledHeight = 300;  // tiles of whole size, and cut ones
const TileGrid kGrid(kTiledWidth, kTiledHeight);

// Tile 1 holds much, tile 5 little, the others nothing.
std::size_t items_of(int tile) { return tile == 1 ? 1000 : tile == 5 ? 100 : 0; }

std::vector<TilePart> parts_for(int threads, DirtyCells& cells) {
  return shared_out(kGrid, cells, threads, items_of);
}

DirtyCells all_dirty() {
  DirtyCells cells;
  cells.reset(kTiledWidth, kTiledHeight, true);
  return cells;
}

TEST(TileParts, PartsCoverEachPixelOnce) {
  for (const int threads : {1, 2, 3, 8, 64}) {
    DirtyCells cells = all_dirty();
    std::vector<int> drawn(std::size_t(kTiledWidth) * kTiledHeight, 0);
    for (const TilePart& part : parts_for(threads, cells)) {
      EXPECT_EQ(intersected(part.box, kGrid.box(part.tile)), part.box);
      for (int y = part.box.y0; y < part.box.y1; ++y)
        for (int x = part.box.x0; x < part.box.x1; ++x) ++drawn[std::size_t(y) * kTiledWidth + x];
    }
    EXPECT_EQ(std::count(drawn.begin(), drawn.end(), 1), std::ssize(drawn)) << threads;
  }
}

TEST(TileParts, SplitsTheDearTileAndBeginsWithIt) {
  DirtyCells cells = all_dirty();
  const std::vector<TilePart> parts = parts_for(2, cells);
  const auto of_tile = [&](int tile) {
    return std::count_if(parts.begin(), parts.end(),
                         [&](const TilePart& part) { return part.tile == tile; });
  };
  EXPECT_GT(of_tile(1), 1);
  EXPECT_EQ(of_tile(5), 1);
  EXPECT_EQ(parts.front().tile, 1);
  EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end(),
                             [](const TilePart& a, const TilePart& b) { return a.cost > b.cost; }));
}

TEST(TileParts, DrawsWhatMovedAlone) {
  DirtyCells cells;
  cells.reset(kTiledWidth, kTiledHeight, false);
  cells.mark({200, 10, 210, 20});
  for (const int threads : {1, 8}) {
    const std::vector<TilePart> parts = parts_for(threads, cells);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].tile, 1);
    EXPECT_EQ(parts[0].box, (PixelBox{192, 0, 224, 32}));
  }
}

constexpr PixelBox kTile{512, 256, 512 + TileGrid::kWidth, 256 + TileGrid::kHeight};

bool within(const RowSpans& spans, const PixelBox& box) {
  for (int y = box.y0; y < box.y1; ++y) {
    const int row = y - kTile.y0;
    if (spans.first(row) > box.x0 - kTile.x0 || spans.last(row) < box.x1 - kTile.x0) return false;
  }
  return true;
}

bool empty(const RowSpans& spans, int row) { return spans.first(row) >= spans.last(row); }

TEST(RowSpans, HoldEveryBoxAndLeaveFarRowsEmpty) {
  RowSpans spans;
  spans.clear(kTile);
  const PixelBox one{520, 263, 540, 265}, other{600, 264, 601, 300};  // across bands of rows
  spans.add(one);
  spans.add(other);
  EXPECT_TRUE(within(spans, one));
  EXPECT_TRUE(within(spans, other));
  EXPECT_TRUE(empty(spans, 0));
  EXPECT_TRUE(empty(spans, 310 - kTile.y0));
  EXPECT_EQ(spans.first(299 - kTile.y0), 600 - kTile.x0);
}

}  // namespace
}  // namespace organbake
