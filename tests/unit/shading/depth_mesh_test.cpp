// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_mesh.h"

#include <gmock/gmock.h>

#include <limits>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

const Intrinsics kCamera = assumed_camera(40, 30, 1.0);

TEST(DepthMesh, AFlatWallIsOneSheetFacingTheCamera) {
  const TriangleMesh mesh =
      mesh_from_depth(Plane(40, 30, 50), Rgb8Image(40, 30), kCamera, {.step_px = 1});
  EXPECT_EQ(mesh.vertices.size(), 1200u);
  EXPECT_EQ(mesh.faces.size(), 2u * 39 * 29);
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) EXPECT_LT(face_normal(mesh, f).z(), -0.99);
}

TEST(DepthMesh, TornAtJumpsAndHolesStayHoles) {
  Plane depth(40, 30, 50);
  for (int y = 0; y < 30; ++y)
    for (int x = 34; x < 40; ++x) depth.at(x, y) = 90;
  depth.at(10, 10) = std::numeric_limits<float>::infinity();
  DepthMeshOptions options{.step_px = 1, .tear = 0.06, .largest_only = false};
  const TriangleMesh both = mesh_from_depth(depth, Rgb8Image(40, 30), kCamera, options);
  EXPECT_EQ(analyse_topology(both).components, 2u);
  options.largest_only = true;
  const TriangleMesh front = mesh_from_depth(depth, Rgb8Image(40, 30), kCamera, options);
  EXPECT_EQ(analyse_topology(front).components, 1u);
  EXPECT_EQ(analyse_topology(front).euler_characteristic, 0) << "a sheet with one hole";
  for (const auto& vertex : front.vertices) EXPECT_LT(vertex.z(), 60);
}

TEST(DepthMesh, NothingToMeshIsAnError) {
  EXPECT_THROW(mesh_from_depth(Plane(40, 30, std::numeric_limits<float>::infinity()),
                               Rgb8Image(40, 30), kCamera, {}),
               BadDataError);
  EXPECT_THROW(mesh_from_depth(Plane(4, 3, 5), Rgb8Image(40, 30), kCamera, {}), BadDataError);
  EXPECT_THROW((DepthMeshOptions{.step_px = 0}.check()), UsageError);
  EXPECT_THROW((DepthMeshOptions{.tear = 0}.check()), UsageError);
}

}  // namespace
}  // namespace organbake
