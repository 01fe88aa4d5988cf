// SPDX-License-Identifier: Apache-2.0
#include "placing/patch_frames.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <array>

#include "organbake/core/random.h"

namespace organbake {
namespace {

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
  face.bent = true;
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
  faces.place(PosedShell(ShellSurface(mesh)), view, false);
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
  int uncut = 0;
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
