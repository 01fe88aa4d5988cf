// SPDX-License-Identifier: Apache-2.0
#include "warp/patch_frames.h"

#include <gtest/gtest.h>

#include <array>

#include "core/random.h"

namespace organbake {
namespace {

View small_view() {
  View view;
  view.camera.intrinsics = {320, 200, 300, 310, 150, 90};
  view.near_mm = 1;
  return view;
}

// A face somewhere round the view, partly before its near plane and beyond its borders.
FaceFrame random_face(RandomStream& random, const View& view) {
  TriangleMesh mesh;
  mesh.faces = {{0, 1, 2}};
  for (int i = 0; i < 3; ++i) {
    mesh.vertices.emplace_back(random.uniform(-60, 60), random.uniform(-60, 60),
                               random.uniform(-20, 150));
  }
  std::vector<FaceFrame> frames;
  face_frames(PosedShell(ShellSurface(mesh)), view, frames);
  FaceFrame face = frames.front();
  face.two_sided = random.below(4) == 0;
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
  int uncut = 0;
  for (int round = 0; round < 300; ++round) {
    const FaceFrame face = random_face(random, view);
    std::vector<Patch> patches(1 + random.below(kPatchBatch));
    for (Patch& patch : patches) patch = random_patch(random);
    std::vector<ChunkFrame> together(patches.size());
    place_patches(PatchTable(patches), 0, static_cast<int>(patches.size()), face, view,
                  together.data());
    for (std::size_t i = 0; i < patches.size(); ++i) {
      ChunkFrame alone;
      place_patches(PatchTable(std::span(&patches[i], 1)), 0, 1, face, view, &alone);
      ASSERT_EQ(together[i], alone) << round << ' ' << i;
      ++fates[static_cast<int>(alone.fate)];
      uncut += alone.uncut;
    }
  }
  for (const int count : fates) EXPECT_GT(count, 100);
  EXPECT_GT(uncut, 100);
}

// What a box promises: every corner of the patch that is before the eye lands inside it.
TEST(PatchFrames, BoxesHoldTheirPatches) {
  RandomStream random(6);
  const View view = small_view();
  const Intrinsics& k = view.camera.intrinsics;
  int corners = 0;
  for (int round = 0; round < 2000; ++round) {
    const FaceFrame face = random_face(random, view);
    const Patch patch = random_patch(random);
    ChunkFrame frame;
    place_patches(PatchTable(std::span(&patch, 1)), 0, 1, face, view, &frame);
    if (frame.fate != ChunkFate::drawn) continue;
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
    }
  }
  EXPECT_GT(corners, 500);
}

TEST(PatchFrames, BatchesAreOfOneFaceAndOfNoMoreThanFit) {
  const std::vector<int> face = [] {
    std::vector<int> faces(3, 0);
    faces.insert(faces.end(), 100, 1);
    faces.push_back(2);
    return faces;
  }();
  const auto face_of = [&](std::size_t i) { return face[i]; };
  EXPECT_EQ(end_of_batch(0, face.size(), face_of), 3u);
  EXPECT_EQ(end_of_batch(0, 2, face_of), 2u);
  EXPECT_EQ(end_of_batch(3, face.size(), face_of), 3u + kPatchBatch);
  EXPECT_EQ(end_of_batch(3 + kPatchBatch, face.size(), face_of), 103u);
  EXPECT_EQ(end_of_batch(103, face.size(), face_of), 104u);
}

}  // namespace
}  // namespace organbake
