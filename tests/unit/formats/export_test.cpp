// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/files.h"
#include "core/temporary_folder.h"
#include "formats/camera_files.h"
#include "formats/gltf.h"
#include "formats/mesh_files.h"
#include "formats/textured_mesh.h"
#include "geometry/mesh_checks.h"
#include "geometry/shell_map.h"
#include "image/srgb.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// Two cameras that differ in everything, one of them with distortion.
CameraSet two_cameras() {
  CameraSet set;
  for (int c = 0; c < 2; ++c) {
    PosedCamera camera;
    camera.name = "cam_00" + std::to_string(c);
    camera.intrinsics = {640, 480 + c, 500.25 + c, 510.5, 320.125, 239.75};
    if (c == 1) camera.intrinsics.k1 = -0.1, camera.intrinsics.p2 = 0.002;
    camera.camera_from_world.rotation =
        Eigen::AngleAxisd(0.4 + c, Eigen::Vector3d(1, 2 - c, -0.5).normalized()).toRotationMatrix();
    camera.camera_from_world.translation = {10.5 - c, -20.25, 300};
    set.cameras.push_back(camera);
    set.images.push_back(camera.name + ".png");
  }
  return set;
}

void expect_same_cameras(const CameraSet& got, const CameraSet& expected) {
  ASSERT_EQ(got.cameras.size(), expected.cameras.size());
  constexpr double kRounding = 1e-12;  // texts hold every digit; a quaternion's trip loses a few
  for (std::size_t c = 0; c < got.cameras.size(); ++c) {
    const PosedCamera &a = got.cameras[c], &b = expected.cameras[c];
    EXPECT_LT((a.camera_from_world.rotation - b.camera_from_world.rotation).norm(), kRounding);
    EXPECT_LT((a.camera_from_world.translation - b.camera_from_world.translation).norm(), 1e-9);
    EXPECT_EQ(a.intrinsics.width, b.intrinsics.width);
    EXPECT_EQ(a.intrinsics.height, b.intrinsics.height);
    for (const auto member : {&Intrinsics::fx, &Intrinsics::fy, &Intrinsics::cx, &Intrinsics::cy,
                              &Intrinsics::k1, &Intrinsics::p2})
      EXPECT_EQ(a.intrinsics.*member, b.intrinsics.*member);
    EXPECT_EQ(got.images[c], expected.images[c]);
  }
}

TEST(ExportedCameras, ComeBackFromColmap) {
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  write_file_atomically(folder.path() / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder.path() / "images.txt", colmap_images_text(set));
  write_file_atomically(folder.path() / "points3D.txt", colmap_points_text());
  expect_same_cameras(read_camera_file(folder.path()), set);
}

TEST(ExportedCameras, ANameThatIsNoUtf8IsRefused) {
  const TemporaryFolder folder;
  CameraSet set = two_cameras();
  set.images.front() = "caf\xe9.png";  // Latin-1
  write_file_atomically(folder.path() / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder.path() / "images.txt", colmap_images_text(set));
  try {
    read_camera_file(folder.path());
    FAIL();
  } catch (const BadDataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("image 1 is no UTF-8"));
  }
}

TEST(ExportedCameras, ComeBackFromTransforms) {
  const TemporaryFolder folder;
  const CameraSet set = two_cameras();
  write_file_atomically(folder.path() / "transforms.json", transforms_json(set));
  expect_same_cameras(read_camera_file(folder.path() / "transforms.json"), set);
}

struct Glb {
  nlohmann::json json;
  std::string buffer;
};

Glb parsed_glb(const std::string& bytes) {
  const auto number = [&](std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(number(4), 2u);
  EXPECT_EQ(number(8), bytes.size());
  const std::size_t length = number(12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(length % 4, 0u);
  EXPECT_EQ(number(20 + length), bytes.size() - 28 - length);
  EXPECT_EQ(bytes.substr(24 + length, 4), std::string("BIN\0", 4));
  return {nlohmann::json::parse(bytes.substr(20, length)), bytes.substr(28 + length)};
}

Eigen::Affine3d transform_of(const nlohmann::json& node) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  const auto t = node.value("translation", std::vector<double>{0, 0, 0});
  const auto q = node.value("rotation", std::vector<double>{0, 0, 0, 1});
  const auto s = node.value("scale", std::vector<double>{1, 1, 1});
  transform.translate(Eigen::Vector3d(t[0], t[1], t[2]));
  transform.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  transform.scale(Eigen::Vector3d(s[0], s[1], s[2]));
  return transform;
}

TEST(Gltf, HoldsTheMeshInMillimetresUnderOneRootInMetres) {
  const TriangleMesh mesh = sphere_mesh(30, 1);
  const Glb glb = parsed_glb(gltf_binary(mesh, two_cameras()));
  const auto& nodes = glb.json["nodes"];
  EXPECT_EQ(glb.json["scenes"][0]["nodes"], nlohmann::json({0}));
  EXPECT_EQ(nodes[0]["children"].size(), nodes.size() - 1);
  for (std::size_t n = 1; n < nodes.size(); ++n) EXPECT_FALSE(nodes[n].contains("scale"));
  // LPS millimetres to y-up metres: superior is up, anterior is towards the viewer.
  const Eigen::Affine3d root = transform_of(nodes[0]);
  EXPECT_LT((root * Eigen::Vector3d(1000, 0, 0) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((root * Eigen::Vector3d(0, 0, 1000) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT((root * Eigen::Vector3d(0, -1000, 0) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);

  EXPECT_EQ(glb.json["accessors"][0]["count"], mesh.vertices.size());
  EXPECT_EQ(glb.json["accessors"][1]["count"], 3 * mesh.faces.size());
  ASSERT_EQ(glb.buffer.size(), 12 * mesh.vertices.size() + 12 * mesh.faces.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Eigen::Vector3f place;
    std::memcpy(place.data(), glb.buffer.data() + 12 * v, 12);
    EXPECT_EQ(place, mesh.vertices[v].cast<float>().eval());
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(glb.json["accessors"][0]["min"][k].get<float>(), place[k]);
      EXPECT_GE(glb.json["accessors"][0]["max"][k].get<float>(), place[k]);
    }
  }
  Face last;
  std::memcpy(last.data(), glb.buffer.data() + glb.buffer.size() - 12, 12);
  EXPECT_EQ(last, mesh.faces.back());
}

TEST(Gltf, CamerasLookWhereOursDo) {
  const CameraSet set = two_cameras();
  const Glb glb = parsed_glb(gltf_binary(sphere_mesh(30, 1), set));
  for (std::size_t c = 0; c < 2; ++c) {
    const PosedCamera& camera = set.cameras[c];
    const auto& node = glb.json["nodes"][2 + c];
    const auto& lens = glb.json["cameras"][node["camera"].get<std::size_t>()];
    const Eigen::Affine3d world_from_gl = transform_of(node);
    const Eigen::Vector3d center = world_from_gl.translation();
    EXPECT_LT((center - camera.center_world_mm()).norm(), 1e-9);
    const Eigen::Vector3d forward = world_from_gl.linear() * Eigen::Vector3d(0, 0, -1);
    EXPECT_LT((forward - camera.view_direction_world()).norm(), 1e-12);
    // A point half-way up the frame's edge, by glTF's formula, falls on the frame's edge in ours
    // but for the principal point, which glTF cannot say.
    const double half = std::tan(lens["perspective"]["yfov"].get<double>() / 2);
    const Eigen::Vector3d top = world_from_gl * Eigen::Vector3d(0, half, -1);
    PosedCamera plain = camera;
    plain.intrinsics.k1 = plain.intrinsics.p2 = 0;
    const Eigen::Vector2d pixel = project(plain, top);
    EXPECT_NEAR(plain.intrinsics.cy - pixel.y(), plain.intrinsics.height / 2.0, 1e-9);
    EXPECT_EQ(lens["extras"]["cx"], camera.intrinsics.cx);
  }
}

TEST(Gltf, RefusesAnEmptyMesh) { EXPECT_THROW(gltf_binary({}, two_cameras()), BadDataError); }

// A layer that stands 1 mm above its proxy, each face of a colour of its own.
BaseLayer flat_layer(const TriangleMesh& proxy, std::uint32_t steps) {
  BaseLayer base;
  base.steps = steps;
  base.face_count = static_cast<std::uint32_t>(proxy.faces.size());
  const std::size_t nodes = std::size_t(base.face_count) * base.nodes_per_face();
  base.height_mm.assign(nodes, 1);
  base.seen_by.assign(nodes, 1);
  for (std::size_t i = 0; i < nodes; ++i) {
    const auto face = static_cast<float>(i / base.nodes_per_face());
    base.color.push_back({face / static_cast<float>(base.face_count), 0.5f, 0.25f});
  }
  return base;
}

TEST(TexturedMesh, IsClosedWhereTheProxyIs) {
  const TriangleMesh proxy = sphere_mesh(30, 1);
  for (const std::uint32_t steps : {1u, 2u, 5u}) {
    const TexturedMesh textured = textured_base(proxy, flat_layer(proxy, steps));
    EXPECT_EQ(textured.faces.size(), proxy.faces.size() * steps * steps);
    TriangleMesh mesh{textured.vertices, {}, {}};
    for (const auto& [a, b, c] : textured.faces)
      mesh.faces.push_back({a.vertex, b.vertex, c.vertex});
    EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
    EXPECT_GT(signed_volume(mesh), signed_volume(proxy));
  }
}

// What a GPU's bilinear filter shows anywhere in a face is the face's own colour.
TEST(TexturedMesh, NoFaceShowsAnothersColour) {
  const TriangleMesh proxy = sphere_mesh(30, 1);
  const BaseLayer base = flat_layer(proxy, 3);
  const TexturedMesh textured = textured_base(proxy, base);
  const Rgb8Image& image = textured.texture;
  for (std::size_t f = 0; f < textured.faces.size(); ++f) {
    const std::size_t face = f / 9;
    const int expected = srgb8_from_linear(base.color[face * base.nodes_per_face()][0]);
    for (const auto& [w0, w1] : {std::pair{1.0, 0.0}, std::pair{0.0, 1.0}, std::pair{0.0, 0.0},
                                 std::pair{0.5, 0.5}, std::pair{0.0, 0.5}, std::pair{0.3, 0.3}}) {
      const auto& corners = textured.faces[f];
      const Eigen::Vector2d uv = w0 * textured.coordinates[corners[0].coordinate] +
                                 w1 * textured.coordinates[corners[1].coordinate] +
                                 (1 - w0 - w1) * textured.coordinates[corners[2].coordinate];
      const double x = uv.x() * image.width - 0.5, y = (1 - uv.y()) * image.height - 0.5;
      const int left = static_cast<int>(std::floor(x + 1e-9));
      const int top = static_cast<int>(std::floor(y + 1e-9));
      for (const auto& [column, row] : {std::pair{left, top}, std::pair{left + 1, top},
                                        std::pair{left, top + 1}, std::pair{left + 1, top + 1}})
        EXPECT_EQ(image.at(column, row)[0], expected) << face;
    }
  }
}

TEST(TexturedMesh, ItsFileIsReadByOthers) {
  const TemporaryFolder folder;
  const TriangleMesh proxy = sphere_mesh(30, 1);
  const TexturedMesh textured = textured_base(proxy, flat_layer(proxy, 2));
  const std::string text = obj_text(textured, "organ.mtl");
  EXPECT_NE(text.find("mtllib organ.mtl\n"), std::string::npos);
  EXPECT_NE(obj_material_text("organ.png").find("map_Kd organ.png\n"), std::string::npos);
  write_file_atomically(folder.path() / "organ.obj", text);
  const TriangleMesh back = read_mesh(folder.path() / "organ.obj");
  EXPECT_EQ(back.faces.size(), textured.faces.size());
  double area = 0;
  for (const auto& [a, b, c] : textured.faces) {
    const Eigen::Vector3d& first = textured.vertices[a.vertex];
    area += 0.5 *
            (textured.vertices[b.vertex] - first).cross(textured.vertices[c.vertex] - first).norm();
  }
  EXPECT_NEAR(surface_area(back), area, 1e-6 * area);  // six digits after the point
}

TEST(TexturedMesh, RefusesAnotherProxysLayer) {
  EXPECT_THROW(textured_base(sphere_mesh(30, 2), flat_layer(sphere_mesh(30, 1), 2)), BadDataError);
  EXPECT_THROW(textured_base(sphere_mesh(30, 1), {}), BadDataError);
}

}  // namespace
}  // namespace organbake
