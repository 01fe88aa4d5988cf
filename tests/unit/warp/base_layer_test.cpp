// SPDX-License-Identifier: Apache-2.0
// What a frame shows where the cameras saw nothing, and how close it comes to the formula
// elsewhere.

#include "drawing/base_drawing.h"
#include "drawing/splat.h"
#include "organbake/core/random.h"
#include "organbake/geometry/shell.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/rasteriser.h"
#include "organbake/warp/warper.h"
#include "placing/placing.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

SyntheticOptions lumpy_base_options() {
  SyntheticOptions options;
  options.organ.lump_share = 0.05;
  options.map_size = 192;
  options.base_step_mm = 1.5;
  return options;
}

const Bundle& lumpy_bundle() {
  static const Bundle bundle = make_synthetic_bundle(lumpy_base_options());
  return bundle;
}

// The organ by its formula, 3×3 rays a pixel; covered where all of them hit.
struct Formula {
  Rgb8Image color;
  std::vector<std::uint8_t> inside;
};

Formula trace_formula(const SyntheticOrgan& organ, const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  const RigidTransform world_from_camera = view.camera.camera_from_world.inverse();
  Formula formula{Rgb8Image(k.width, k.height),
                  std::vector<std::uint8_t>(std::size_t(k.width) * k.height, 0)};
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int hits = 0;
      for (int ray = 0; ray < 9; ++ray) {
        const Eigen::Vector3d direction((x + (ray % 3 + 0.5) / 3 - k.cx) / k.fx,
                                        (y + (ray / 3 + 0.5) / 3 - k.cy) / k.fy, 1);
        const Eigen::Vector3d origin = world_from_camera.translation;
        const Eigen::Vector3d along = world_from_camera.rotation * direction;
        const double t = organ.trace(origin, along);
        if (!std::isfinite(t)) continue;
        sum += organ.color(origin + t * along);
        ++hits;
      }
      if (hits < 9) continue;
      formula.inside[std::size_t(y) * k.width + x] = 1;
      for (int c = 0; c < 3; ++c) formula.color.at(x, y)[c] = srgb8_from_linear(sum[c] / 9);
    }
  }
  return formula;
}

// Makes a bundle whose cameras saw nothing within a ball.
void hide_from_cameras(Bundle& bundle, const Eigen::Vector3d& middle, double radius_mm) {
  const auto hidden = [&](const Eigen::Vector3d& p) { return (p - middle).norm() < radius_mm; };
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    CameraMaps& maps = bundle.maps[c];
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const RigidTransform world_from_camera = camera.camera_from_world.inverse();
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      const Eigen::Vector2d pixel(double(i % maps.width) + 0.5, double(i / maps.width) + 0.5);
      const Eigen::Vector3d p =
          world_from_camera * (double(maps.depth_mm[i]) * unproject(camera.intrinsics, pixel));
      if (hidden(p)) maps.face[i] = kNoFace, maps.confidence[i] = 0;
    }
  }
  BaseLayer& base = bundle.base;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(bundle.proxy);
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix shell = shell_matrix(bundle.proxy, normals, f);
    for (std::uint32_t i = 0; i <= base.steps; ++i) {
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t node =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const Eigen::Vector3d p = shell_point(shell, double(i) / base.steps, double(j) / base.steps,
                                              base.height_mm[node]);
        if (hidden(p)) base.seen_by[node] = 0;
      }
    }
  }
}

const Eigen::Vector3d kBetweenCameras(0.5, -1, 0.4);

TEST(WarpedFrame, ComesCloseToTheFormula) {
  const Bundle& bundle = lumpy_bundle();
  const View view = view_from(bundle, kBetweenCameras, 256);
  const Formula truth = trace_formula(lumpy_base_options().organ, view);
  Frame frame;
  Warper(bundle).draw(bundle.proxy.vertices, view, {}, frame);
  // One sample a pixel against nine: texture of 3 mm at 0.6 mm a pixel leaves about 36 dB.
  constexpr double kLeastDb = 33;
  EXPECT_GT(compare_images(frame.color, truth.color, truth.inside).psnr_db, kLeastDb);
}

TEST(BaseLayer, TakesOverWhereNoCameraSawTheSkin) {
  Bundle bundle = lumpy_bundle();
  const View view = view_from(bundle, kBetweenCameras, 256);
  const Formula truth = trace_formula(lumpy_base_options().organ, view);
  const Eigen::Vector3d towards_eye = kBetweenCameras.normalized();
  const SyntheticOrgan organ = lumpy_base_options().organ;
  hide_from_cameras(bundle, organ.center + organ.radius(towards_eye) * towards_eye, 15);
  Warper warper(bundle);
  Frame frame;
  const DrawReport with = warper.draw(bundle.proxy.vertices, view, {}, frame);
  EXPECT_GT(with.base_pixels, 1000u);
  EXPECT_EQ(holes_in(frame), 0u);
  std::vector<std::uint8_t> shown_by_base = truth.inside;
  for (std::size_t i = 0; i < shown_by_base.size(); ++i) {
    EXPECT_TRUE(!truth.inside[i] || frame.cover[i] != Cover::background);
    shown_by_base[i] &= frame.cover[i] == Cover::base;
  }
  // Gouraud shading between nodes 1.5 mm apart.
  constexpr double kLeastDb = 26;
  EXPECT_GT(compare_images(frame.color, truth.color, shown_by_base).psnr_db, kLeastDb);

  bundle.base = {};
  Warper(bundle).draw(bundle.proxy.vertices, view, {}, frame);
  std::size_t open = 0;
  for (std::size_t i = 0; i < truth.inside.size(); ++i) {
    open += truth.inside[i] && frame.cover[i] == Cover::background;
  }
  EXPECT_GT(open, 1000u);
}

constexpr PixelBox kPicture{0, 0, 64, 64};

TEST(Rasterise, SharedEdgesAreDrawnOnce) {
  // A fan of triangles round a point, whatever way each winds: every pixel exactly once.
  RandomStream random(4);
  for (int round = 0; round < 50; ++round) {
    std::vector<int> count(64 * 64, 0);
    const SnappedCorner middle{random.uniform(20, 44), random.uniform(20, 44), 1};
    const SnappedCorner rim[] = {{2, 2, 1},   {random.uniform(10, 50), 1, 1},  {62, 3, 1},
                                 {61, 60, 1}, {random.uniform(10, 50), 62, 1}, {3, 61, 1}};
    for (int i = 0; i < 6; ++i) {
      std::array<SnappedCorner, 3> t = {middle, rim[i], rim[(i + 1) % 6]};
      if (i % 2) std::swap(t[1], t[2]);
      rasterise(SnappedTriangle(t[0], t[1], t[2]), kPicture,
                [&](int x, int y, double, const auto&) { ++count[y * 64 + x]; });
    }
    for (const int n : count) ASSERT_LE(n, 1);
    for (int y = 5; y < 58; ++y) {
      for (int x = 5; x < 58; ++x) ASSERT_EQ(count[y * 64 + x], 1) << x << "," << y;
    }
  }
}

TEST(Rasterise, WeightsAreCorrectInPerspective) {
  // Depths 100, 200, 400 at the corners: at a pixel, 1/z is linear.
  rasterise(SnappedTriangle({4, 4, 1 / 100.0}, {60, 4, 1 / 200.0}, {4, 60, 1 / 400.0}), kPicture,
            [&](int x, int y, double depth, const std::array<double, 3>& w) {
              const double u = (x + 0.5 - 4) / 56, v = (y + 0.5 - 4) / 56;
              const double inverse = (1 - u - v) / 100 + u / 200 + v / 400;
              // The rule for shared edges moves an edge by 1/256² of a pixel.
              EXPECT_NEAR(depth * inverse, 1, 1e-7);
              EXPECT_NEAR(w[0] * 100 + w[1] * 200 + w[2] * 400, depth, 1e-9 * depth);
            });
}

TEST(Rasterise, StaysInItsWindow) {
  rasterise(SnappedTriangle({-500, -400, 1}, {900, -300, 1}, {30, 800, 1}), kPicture,
            [&](int x, int y, double, const auto&) {
              ASSERT_TRUE(x >= 0 && y >= 0 && x < 64 && y < 64);
            });
  for (const PixelBox& window :
       {PixelBox{3, 2, 64, 61}, PixelBox{0, 0, 5, 7}, PixelBox{9, 9, 18, 10}}) {
    std::vector<int> count(64 * 64, 0);
    rasterise(SnappedTriangle({-500, -400, 1}, {900, -300, 1}, {30, 800, 1}), window,
              [&](int x, int y, double, const auto&) {
                ASSERT_TRUE(x >= window.x0 && y >= window.y0 && x < window.x1 && y < window.y1);
                ++count[y * 64 + x];
              });
    for (int y = window.y0; y < window.y1; ++y)
      for (int x = window.x0; x < window.x1; ++x) EXPECT_EQ(count[y * 64 + x], 1) << x << "," << y;
  }
  const double huge = 1e12;
  rasterise(SnappedTriangle({-huge, 0, 1}, {huge, 0, 1}, {0, huge, 1}), kPicture,
            [&](int, int, double, const auto&) { FAIL(); });  // beyond reach: the clipper's to cut
}

// Two layers of random depths over a tile of a given size.
void check_tile(const PixelBox& tile) {
  RandomStream random(std::uint64_t(tile.width()) * 1000 + tile.height());
  std::array<TileKeys, 2> layers;
  for (TileKeys& layer : layers) {
    layer.clear(tile, tile);
    for (std::uint64_t& key : layer.keys)  // the guard band too: it must not count
      if (random.uniform(0, 1) < 0.97)
        key = std::uint64_t{key_high(float(random.uniform(50, 90)), 5)} << 32 | random.below(1000);
  }
  const std::array<const TileKeys*, 2> both = {&layers[0], &layers[1]};
  DrawnSamples samples;
  samples.begin(tile, both);
  float farthest = 0;
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const auto depth = [&](const TileKeys& layer) {
        return depth_of(static_cast<std::uint32_t>(layer.row(y)[x - tile.x0] >> 32));
      };
      const float nearest = std::min(depth(layers[0]), depth(layers[1]));
      ASSERT_EQ(samples.open(x, y), std::isinf(nearest)) << x << ',' << y;
      ASSERT_GE(samples.farthest_mm({x, y, x + 1, y + 1}), nearest);
      farthest = std::max(farthest, nearest);
    }
  ASSERT_EQ(samples.farthest_mm(tile), farthest);
}

TEST(DrawnSamples, AreOpenWhereNoLayerTookAndAsFarAsTheirCells) {
  constexpr int kWidth = TileGrid::kWidth, kHeight = TileGrid::kHeight;
  check_tile({kWidth, kHeight, 2 * kWidth, 2 * kHeight});
  check_tile({2 * kWidth, 0, 2 * kWidth + 65, 9});
  check_tile({3, 5, 7, 6});
}

View small_view() {
  View view;
  view.camera.intrinsics = {320, 200, 300, 310, 150, 90};
  view.near_mm = 1;
  return view;
}

// As a deep poke bends it.
void bend(RandomStream& random, FaceFrame& face) {
  for (int k = 6; k < 9; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      face.metric(axis, k) = static_cast<float>(random.uniform(-30, 30));
  }
}

// A face somewhere round the view, partly before its near plane and beyond its borders.
FaceFrame random_face(RandomStream& random, const View& view) {
  TriangleMesh mesh;
  mesh.faces = {{0, 1, 2}};
  for (int i = 0; i < 3; ++i) {
    mesh.vertices.emplace_back(random.uniform(-60, 60), random.uniform(-60, 60),
                               random.uniform(-20, 150));
  }
  PlacedFaces faces;
  faces.place(PosedShell(ShellSurface(mesh)), view, 1, false);
  FaceFrame face = faces[0];
  face.two_sided = random.below(4) == 0;
  if (random.below(2) == 0) bend(random, face);
  return face;
}

Patch random_patch(RandomStream& random) {
  const auto about = [&](double reach) {
    return static_cast<float>(random.uniform(-reach, reach));
  };
  Patch patch;
  for (int k = 0; k < 3; ++k) {
    patch.center[k] = about(1);
    patch.extent[k] = std::abs(about(0.05));
    patch.along_u[k] = about(0.02);
    patch.along_v[k] = about(0.02);
  }
  patch.cone = NormalCone(std::abs(about(1)));
  return patch;
}

TEST(PatchFrames, ABatchIsPlacedAsEachPatchAlone) {
  RandomStream random(5);
  const View view = small_view();
  std::array<int, 3> fates{};
  for (int round = 0; round < 300; ++round) {
    std::vector<FaceFrame> faces(3);
    for (FaceFrame& face : faces) face = random_face(random, view);
    std::vector<Patch> patches(1 + random.below(kPatchBatch));
    for (Patch& patch : patches) {
      patch = random_patch(random);
      patch.face = static_cast<std::uint32_t>(random.below(faces.size()));
    }
    std::vector<ChunkFrame> together(patches.size());
    place_patches(PatchTable(patches), 0, static_cast<int>(patches.size()), faces, view,
                  together.data());
    for (std::size_t i = 0; i < patches.size(); ++i) {
      ChunkFrame alone;
      place_patches(PatchTable(std::span(&patches[i], 1)), 0, 1, faces, view, &alone);
      ASSERT_EQ(together[i], alone) << round << ' ' << i;
      ++fates[static_cast<int>(alone.visibility)];
    }
  }
  for (const int count : fates) EXPECT_GT(count, 100);
}

// What a box promises: every corner of the patch that is before the eye lands inside it, and no
// nearer than it says.
TEST(PatchFrames, BoxesHoldTheirPatches) {
  RandomStream random(6);
  const View view = small_view();
  const Intrinsics& k = view.camera.intrinsics;
  int corners = 0;
  for (int round = 0; round < 2000; ++round) {
    const FaceFrame face = random_face(random, view);
    const Patch patch = random_patch(random);
    ChunkFrame frame;
    place_patches(PatchTable(std::span(&patch, 1)), 0, 1, std::span(&face, 1), view, &frame);
    if (frame.visibility != ChunkVisibility::drawn) continue;
    ShellMatrix shell = face.metric.topRows<3>().cast<double>();
    for (int corner = 0; corner < 8; ++corner) {
      const auto at = [&](int axis) {
        return patch.center[axis] + (corner >> axis & 1 ? 1 : -1) * double(patch.extent[axis]);
      };
      const Eigen::Vector3d p = shell_point(shell, at(0), at(1), at(2));
      const double x = k.fx * p.x() / p.z() + k.cx, y = k.fy * p.y() / p.z() + k.cy;
      if (p.z() < view.near_mm || x < 0 || y < 0 || x >= k.width || y >= k.height) continue;
      ++corners;
      ASSERT_TRUE(x >= frame.box.x0 && x < frame.box.x1 && y >= frame.box.y0 && y < frame.box.y1);
      ASSERT_GT(p.z(), frame.nearest_mm * (1 - 1e-5));
    }
  }
  EXPECT_GT(corners, 500);
}

// What facing away promises: no point of the patch's face shows its outer side there.
TEST(PatchFrames, PatchesThatFaceAwayShowNowhere) {
  RandomStream random(8);
  const View view = small_view();
  int away = 0;
  for (int round = 0; round < 4000; ++round) {
    FaceFrame face = random_face(random, view);
    face.two_sided = false;
    Patch patch = random_patch(random);
    // Along the face itself, whose normal the map tells everywhere.
    patch.along_u[0] = 0, patch.along_u[1] = 0.02f, patch.along_v[0] = 0.02f, patch.along_v[1] = 0;
    patch.along_u[2] = patch.along_v[2] = patch.extent[2] = 0;
    patch.cone = NormalCone(0);
    ChunkFrame frame;
    place_patches(PatchTable(std::span(&patch, 1)), 0, 1, std::span(&face, 1), view, &frame);
    if (frame.visibility != ChunkVisibility::faces_away) continue;
    ++away;
    const ShellMatrix shell = face.metric.topRows<3>().cast<double>();
    for (int corner = 0; corner < 4; ++corner) {
      const double b1 = patch.center[0] + (corner & 1 ? 1 : -1) * double(patch.extent[0]),
                   b2 = patch.center[1] + (corner & 2 ? 1 : -1) * double(patch.extent[1]);
      const Eigen::Matrix3d by = shell_jacobian(shell, b1, b2, patch.center[2]);
      const Eigen::Vector3d normal = by.col(0).cross(by.col(1));
      EXPECT_GE(normal.dot(shell_point(shell, b1, b2, patch.center[2])), 0) << round;
    }
  }
  EXPECT_GT(away, 500);
}

}  // namespace
}  // namespace organbake
