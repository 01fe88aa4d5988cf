// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/ply.h"

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

TriangleMesh parsed(const std::string& text) {
  return parse_ply(std::as_bytes(std::span(text.data(), text.size())), "test.ply");
}

TEST(Ply, RoundTripIsExact) {
  TriangleMesh mesh = lumpy_mesh(50, 2);
  RandomStream random(3);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.colors.emplace_back(random.uniform(), random.uniform(), random.uniform());
  const TriangleMesh back = parsed(serialise_ply(mesh));
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.faces, mesh.faces);
  EXPECT_EQ(back.colors, mesh.colors);
}

TEST(Ply, ReadsAsciiQuadsWithForeignProperties) {
  const TriangleMesh mesh = parsed(
      "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\n"
      "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty float quality\nelement face 1\n"
      "property list uchar int vertex_index\nproperty int region\nend_header\n"
      "0 0 0 255 0 0 0.5\n1 0 0 255 0 0 0.5\n1 1 0 255 0 0 0.5\n0 1 0 188 0 0 0.5\n4 0 1 2 3 7\n");
  ASSERT_EQ(mesh.faces.size(), 2u);
  EXPECT_EQ(mesh.faces[1], (Face{0, 2, 3}));
  EXPECT_EQ(mesh.colors[0].x(), 1.0f);
  EXPECT_NEAR(mesh.colors[3].x(), 0.5029f, 1e-3);  // sRGB 188 is about half of the light
}

std::string square_header(const std::string& colors, const std::string& faces) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\n" +
         colors + faces + "end_header\n";
}

// The same colour, 198 90 103 in sRGB, in every way that programs write it.
TEST(Ply, ReadsColoursOfEveryType) {
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  struct Way {
    const char *type, *prefix, *color;
  };
  for (const Way& way :
       {Way{"uchar", "", "198 90 103"}, Way{"float", "", "198 90 103"},
        Way{"int", "", "198 90 103"}, Way{"float", "", "0.7764706 0.3529412 0.4039216"},
        Way{"ushort", "", "50886 23130 26471"}, Way{"uchar", "diffuse_", "198 90 103"}}) {
    std::string properties, rows;
    for (const char* name : {"red", "green", "blue"})
      properties += std::string("property ") + way.type + " " + way.prefix + name + "\n";
    for (const char* place : {"0 0 0 ", "1 0 0 ", "1 1 0 ", "0 1 0 "})
      rows += std::string(place) + way.color + "\n";
    const TriangleMesh mesh = parsed(square_header(properties, face) + rows + "4 0 1 2 3\n");
    ASSERT_EQ(mesh.colors.size(), 4u) << way.type << way.color;
    constexpr float kOfAByte = 1e-4f;  // colours of 7 digits, far below an sRGB step
    EXPECT_NEAR(mesh.colors[2].x(), 0.564712f, kOfAByte) << way.type << way.color;
    EXPECT_NEAR(mesh.colors[2].y(), 0.102242f, kOfAByte) << way.type << way.color;
  }
}

TEST(Ply, FaceColoursBecomeTheirVertices) {
  const TriangleMesh mesh =
      parsed(square_header("",
                           "element face 2\nproperty list uchar int vertex_indices\n"
                           "property uchar red\nproperty uchar green\nproperty uchar blue\n") +
             "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n");
  ASSERT_EQ(mesh.colors.size(), 4u);
  EXPECT_EQ(mesh.colors[1], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(mesh.colors[0], Eigen::Vector3f(0.5f, 0, 0.5f));
}

// A square of 80 with a notch of 20 × 40: 5,600 mm²; a fan about its first corner covers more.
TEST(Ply, ConcavePolygonsKeepTheirArea) {
  const std::string notched =
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
      "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "8 0 1 2 3 4 5 6 7\n0 0 0\n80 0 0\n80 80 0\n50 80 0\n50 40 0\n30 40 0\n30 80 0\n0 80 0\n";
  const TriangleMesh mesh = parsed(notched);
  EXPECT_EQ(mesh.faces.size(), 6u);
  EXPECT_DOUBLE_EQ(surface_area(mesh), 5600);
  for (std::size_t f = 0; f < 6; ++f) EXPECT_GT(face_normal(mesh, f).z(), 0) << f;
}

TEST(Ply, ReadsTriangleStrips) {
  const TriangleMesh mesh =
      parsed(square_header("", "element tristrips 1\nproperty list int int vertex_indices\n") +
             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 2 1 3\n");
  ASSERT_EQ(mesh.faces.size(), 3u);
  EXPECT_EQ(mesh.faces[0], (Face{0, 1, 2}));
  EXPECT_EQ(mesh.faces[1], (Face{2, 1, 3}));
}

TEST(Ply, ReadsBigEndian) {
  const TriangleMesh mesh = lumpy_mesh(50, 2);
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
      std::to_string(mesh.faces.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto append = [&](auto value) {
    char raw[sizeof(value)];
    std::memcpy(raw, &value, sizeof(value));
    bytes.append(std::reverse_iterator(raw + sizeof(value)), std::reverse_iterator(raw));
  };
  for (const auto& v : mesh.vertices)
    for (int c = 0; c < 3; ++c) append(v[c]);
  for (const Face& f : mesh.faces) {
    bytes += '\x03';
    for (const std::uint32_t v : f) append(v);
  }
  const TriangleMesh back = parsed(bytes);
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.faces, mesh.faces);
}

TEST(Ply, RefusesWhatItCannotTrust) {
  const std::string good = serialise_ply(tetrahedron_mesh());
  EXPECT_THROW(parsed(""), BadDataError);
  EXPECT_THROW(parsed("solid x\n"), BadDataError);
  EXPECT_THROW(parsed(good.substr(0, good.size() - 1)), BadDataError);
  EXPECT_THROW(parsed(good.substr(0, 40)), BadDataError);
  const auto with = [&](const char* from, const char* to) {
    std::string text = good;
    return text.replace(text.find(from), std::strlen(from), to);
  };
  EXPECT_THROW(parsed(with("vertex 4", "vertex 4000000000")), BadDataError);
  EXPECT_THROW(parsed(with("vertex 4", "vertex -4")), BadDataError);
  EXPECT_THROW(parsed(with("little", "middle")), BadDataError);
  EXPECT_THROW(parsed(with("property double z\n", "")), BadDataError);
  EXPECT_THROW(parsed(with("double x", "quad x")), BadDataError);
  EXPECT_THROW(parsed(with("face 4", "face 3000")), BadDataError);
}

}  // namespace
}  // namespace organbake
