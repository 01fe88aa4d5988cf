// SPDX-License-Identifier: Apache-2.0
#include "geometry/ply.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "core/error.h"
#include "core/random.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TriangleMesh parsed(const std::string& text) {
  return parse_ply(std::as_bytes(std::span(text.data(), text.size())), "test.ply");
}

TEST(Ply, RoundTripIsExact) {
  TriangleMesh mesh = lumpy_mesh(50, 2);
  RandomStream random(3);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.colors.emplace_back(random.uniform(), random.uniform(), random.uniform());
  }
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
  EXPECT_THROW(parsed(with("little", "big")), BadDataError);
  EXPECT_THROW(parsed(with("property double z\n", "")), BadDataError);
  EXPECT_THROW(parsed(with("double x", "quad x")), BadDataError);
  EXPECT_THROW(parsed(with("face 4", "face 3000")), BadDataError);
}

TEST(Ply, SurvivesEverySingleFlippedByte) {
  const std::string good = serialise_ply(tetrahedron_mesh());
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x81);
    try {
      parsed(bad);  // a changed coordinate may well pass
    } catch (const BadDataError&) {
    }
  }
}

}  // namespace
}  // namespace organbake
