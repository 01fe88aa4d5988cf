// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/exchange/exports.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/image/png.h"
#include "posed_cameras.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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

// A sphere whose every face is a piece of the atlas for itself.
TexturedMesh textured_sphere() {
  const TriangleMesh sphere = sphere_mesh(30, 1);
  TexturedMesh mesh;
  mesh.vertices = sphere.vertices;
  for (const Eigen::Vector3d& v : sphere.vertices) mesh.normals.push_back(v.normalized());
  for (const Face& face : sphere.faces) {
    std::array<TexturedMesh::Corner, 3> corners;
    for (int k = 0; k < 3; ++k) {
      corners[k] = {face[k], static_cast<std::uint32_t>(mesh.coordinates.size())};
      mesh.coordinates.emplace_back(0.25 * k, 0.125 + 0.25 * k);
      mesh.tangents.push_back(mesh.normals[face[k]].unitOrthogonal());
    }
    mesh.faces.push_back(corners);
  }
  mesh.color = Rgb8Image(4, 4);
  mesh.normal_map = Rgb8Image(2, 2);
  mesh.roughness = 0.375;
  return mesh;
}

// The floats of an accessor, `components` each.
std::vector<Eigen::VectorXf> vectors_of(const Glb& glb, std::size_t accessor, int components) {
  const auto& a = glb.json["accessors"][accessor];
  const auto& view = glb.json["bufferViews"][a["bufferView"].get<std::size_t>()];
  const std::size_t start = view["byteOffset"];
  EXPECT_EQ(start % 4, 0u);
  EXPECT_EQ(view["byteLength"], a["count"].get<std::size_t>() * components * sizeof(float));
  std::vector<Eigen::VectorXf> vectors;
  for (std::size_t i = 0; i < a["count"]; ++i) {
    Eigen::VectorXf v(components);
    std::memcpy(v.data(), glb.buffer.data() + start + i * components * sizeof(float),
                components * sizeof(float));
    vectors.push_back(v);
  }
  return vectors;
}

TEST(Gltf, HoldsTheMeshInMetresWithYUp) {
  const TexturedMesh mesh = textured_sphere();
  const Glb glb = parsed_glb(gltf_binary(mesh, {}));
  const auto& primitive = glb.json["meshes"][0]["primitives"][0];
  const auto& attributes = primitive["attributes"];
  const auto places = vectors_of(glb, attributes["POSITION"], 3);
  const auto normals = vectors_of(glb, attributes["NORMAL"], 3);
  const auto tangents = vectors_of(glb, attributes["TANGENT"], 4);
  const auto coordinates = vectors_of(glb, attributes["TEXCOORD_0"], 2);
  ASSERT_EQ(places.size(), mesh.coordinates.size());
  std::size_t at = 0;
  for (const auto& face : mesh.faces)
    for (const TexturedMesh::Corner& corner : face) {
      const Eigen::Vector3d& v = mesh.vertices[corner.vertex];
      // Superior is up, anterior is towards the viewer.
      EXPECT_LT((places[at] - Eigen::Vector3f(v.x(), v.z(), -v.y()) / 1000).norm(), 1e-8);
      EXPECT_NEAR(normals[at].dot(places[at].normalized()), 1, 1e-6) << "a sphere";
      EXPECT_NEAR(tangents[at].head(3).norm(), 1, 1e-6);
      EXPECT_EQ(tangents[at][3], 1);
      EXPECT_EQ(coordinates[at].x(), float(mesh.coordinates[corner.coordinate].x()));
      EXPECT_EQ(coordinates[at].y(), float(1 - mesh.coordinates[corner.coordinate].y()));
      for (int k = 0; k < 3; ++k) {
        const auto& bounds = glb.json["accessors"][attributes["POSITION"].get<std::size_t>()];
        EXPECT_LE(bounds["min"][k].get<float>(), places[at][k]);
        EXPECT_GE(bounds["max"][k].get<float>(), places[at][k]);
      }
      ++at;
    }
  EXPECT_EQ(glb.json["accessors"][primitive["indices"].get<std::size_t>()]["count"],
            3 * mesh.faces.size());
}

TEST(Gltf, HoldsItsTexturesAndMaterial) {
  const TexturedMesh mesh = textured_sphere();
  const Glb glb = parsed_glb(gltf_binary(mesh, {}));
  const auto& material = glb.json["materials"][0];
  EXPECT_EQ(material["pbrMetallicRoughness"]["roughnessFactor"], 0.375);
  EXPECT_EQ(material["pbrMetallicRoughness"]["metallicFactor"], 0);
  const auto size_of = [&](const nlohmann::json& texture) {
    const std::size_t image = glb.json["textures"][texture["index"].get<std::size_t>()]["source"];
    const auto& view =
        glb.json["bufferViews"][glb.json["images"][image]["bufferView"].get<std::size_t>()];
    const std::string bytes = glb.buffer.substr(view["byteOffset"], view["byteLength"]);
    return parse_png(std::as_bytes(std::span(bytes.data(), bytes.size())), "texture").color.width;
  };
  EXPECT_EQ(size_of(material["pbrMetallicRoughness"]["baseColorTexture"]), 4);
  EXPECT_EQ(size_of(material["normalTexture"]), 2);

  TexturedMesh without = mesh;
  without.normal_map = {};
  const Glb flat = parsed_glb(gltf_binary(without, {}));
  EXPECT_FALSE(flat.json["materials"][0].contains("normalTexture"));
  EXPECT_FALSE(flat.json["meshes"][0]["primitives"][0]["attributes"].contains("TANGENT"));
}

TEST(Gltf, CamerasLookWhereOursDo) {
  const CameraSet set = two_cameras();
  const Glb glb = parsed_glb(gltf_binary(textured_sphere(), set));
  EXPECT_EQ(glb.json["scenes"][0]["nodes"].size(), glb.json["nodes"].size());
  for (std::size_t c = 0; c < 2; ++c) {
    const PosedCamera& camera = set.cameras[c];
    const auto& node = glb.json["nodes"][1 + c];
    const auto& lens = glb.json["cameras"][node["camera"].get<std::size_t>()];
    const Eigen::Affine3d scene_from_gl = transform_of(node);
    EXPECT_LT((scene_from_gl.translation() - scene_from_world(camera.center_world_mm())).norm(),
              1e-12);
    const Eigen::Vector3d forward = scene_from_gl.linear() * Eigen::Vector3d(0, 0, -1);
    EXPECT_LT((forward - scene_direction(camera.view_direction_world())).norm(), 1e-12);
    // A point half-way up the frame's edge, by glTF's formula, falls on the frame's edge in ours
    // but for the principal point, which glTF cannot say.
    const double half = std::tan(lens["perspective"]["yfov"].get<double>() / 2);
    const Eigen::Vector3d top_m = scene_from_gl * Eigen::Vector3d(0, half, -1);
    PosedCamera plain = camera;
    plain.intrinsics.k1 = plain.intrinsics.p2 = 0;
    const Eigen::Vector2d pixel =
        project(plain, 1000 * Eigen::Vector3d(top_m.x(), -top_m.z(), top_m.y()));
    EXPECT_NEAR(plain.intrinsics.cy - pixel.y(), plain.intrinsics.height / 2.0, 1e-9);
    EXPECT_EQ(lens["extras"]["cx"], camera.intrinsics.cx);
  }
}

TEST(Gltf, RefusesAnEmptyMesh) { EXPECT_THROW(gltf_binary({}, two_cameras()), BadDataError); }

TEST(TexturedMesh, ItsObjFileIsReadByOthers) {
  const TemporaryFolder folder;
  const TexturedMesh mesh = textured_sphere();
  const std::string text = obj_text(mesh, "organ.mtl");
  EXPECT_NE(text.find("mtllib organ.mtl\n"), std::string::npos);
  EXPECT_NE(text.find("# metres, y up"), std::string::npos);
  const std::string material = obj_material_text(mesh, "organ.png", "bumps.png");
  EXPECT_NE(material.find("map_Kd organ.png\n"), std::string::npos);
  EXPECT_NE(material.find("norm bumps.png\n"), std::string::npos);
  write_file_atomically(folder.path() / "organ.obj", text);
  const TriangleMesh back = read_mesh(folder.path() / "organ.obj");
  ASSERT_EQ(back.vertices.size(), mesh.vertices.size());
  constexpr double kWritten_mm = 1e-4;
  for (std::size_t v = 0; v < back.vertices.size(); ++v)
    EXPECT_LT((back.vertices[v] - mesh.vertices[v]).norm(), kWritten_mm);
  EXPECT_EQ(back.faces.size(), mesh.faces.size());
}

}  // namespace
}  // namespace organbake
