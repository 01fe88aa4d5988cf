// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/mesh_readers.h"

#include "organbake/core/temporary_files.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

template <class Number>
std::string packed(std::initializer_list<Number> numbers) {
  return {reinterpret_cast<const char*>(std::data(numbers)), sizeof(Number) * numbers.size()};
}

// A document whose one buffer lies beside it: four places, then what a test adds.
class GltfReaderTest : public ::testing::Test {
 protected:
  TriangleMesh read(const std::string& json) {
    write_bytes(folder_.path() / "a b.bin", buffer_);
    write_bytes(
        folder_.path() / "a.gltf",
        R"({"asset":{"version":"2.0"},"buffers":[{"uri":"a%20b.bin","byteLength":)" +
            std::to_string(buffer_.size()) +
            R"(}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":)" +
            std::to_string(buffer_.size() - 48) + "}]," + json + "}");
    said_.clear();
    const RunContext context([&](LogLevel, std::string_view text) { said_ += text; }, {}, nullptr);
    return read_gltf(folder_.path() / "a.gltf", context);
  }
  std::string error(const std::string& json) {
    return message_of(ExitCode::bad_data, [&] { read(json); });
  }
  // One node with one primitive.
  static std::string scene(const std::string& primitive, const std::string& accessors,
                           const std::string& node = {}) {
    return R"("nodes":[{"mesh":0)" + node + R"(}],"meshes":[{"primitives":[{"attributes":{)" +
           primitive + R"(}]}],"accessors":[)" + kPlaces + accessors + "]";
  }
  static constexpr const char* kPlaces =
      R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":4})";
  // As above, with something more in the primitive or in the document.
  static std::string posed(const std::string& node, const std::string& accessors,
                           const std::string& attributes = {}, const std::string& targets = {},
                           const std::string& document = {}) {
    return scene(R"("POSITION":0)" + attributes + R"(},"mode":5)" + targets, accessors, node) +
           document;
  }
  // Of `count` floats that lie behind the places, from the byte `at`.
  static std::string floats(const char* type, int count, int at = 0) {
    return R"(,{"bufferView":1,"componentType":5126,"type":")" + std::string(type) +
           R"(","byteOffset":)" + std::to_string(at) + R"(,"count":)" + std::to_string(count) + "}";
  }
  TemporaryFolder folder_;
  std::string said_;
  std::string buffer_ = packed<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
};

TEST_F(GltfReaderTest, StripsAndFansKeepTheirSense) {
  const TriangleMesh strip = read(scene(R"("POSITION":0},"mode":5)", ""));
  EXPECT_EQ(strip.faces, (std::vector<Face>{{0, 1, 2}, {2, 1, 3}}));
  const TriangleMesh fan = read(scene(R"("POSITION":0},"mode":6)", ""));
  EXPECT_EQ(fan.faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(read(scene(R"("POSITION":0},"mode":1)", "")).faces.empty()) << "lines";
}

TEST_F(GltfReaderTest, IndicesColoursAndSparsePlaces) {
  buffer_ += packed<std::uint8_t>({3, 2, 1, 0});                   // corners
  buffer_ += packed<std::uint8_t>({255, 0, 51, 255, 0, 0, 0, 255,  // RGBA
                                   0, 0, 0, 255, 0, 0, 0, 255});
  buffer_ += packed<std::uint16_t>({2, 0}) + packed<float>({7, 8, 9});  // the third place's own
  const std::string more =
      R"(,{"bufferView":1,"componentType":5121,"type":"SCALAR","count":3},
          {"bufferView":1,"byteOffset":4,"componentType":5121,"normalized":true,"type":"VEC4","count":4})";
  std::string json = scene(R"("POSITION":0,"COLOR_0":2},"indices":1)", more);
  json.replace(
      json.find("\"count\":4"), 9,
      R"("count":4,"sparse":{"count":1,"indices":{"bufferView":1,"byteOffset":20,"componentType":5123},
                  "values":{"bufferView":1,"byteOffset":24}})");
  const TriangleMesh mesh = read(json);
  EXPECT_EQ(mesh.faces, (std::vector<Face>{{3, 2, 1}}));
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(mesh.vertices[3], Eigen::Vector3d(1, 1, 0));
  ASSERT_EQ(mesh.colors.size(), 4u);
  EXPECT_FLOAT_EQ(mesh.colors[0].x(), 1);
  EXPECT_FLOAT_EQ(mesh.colors[0].z(), 0.2f) << "linear as it stands";
}

TEST_F(GltfReaderTest, NodesMoveTurnAndMirror) {
  const std::string half = std::to_string(std::sqrt(0.5));
  const TriangleMesh turned = read(scene(
      R"("POSITION":0},"mode":5)", "",
      R"(,"translation":[5,0,0],"rotation":[0,0,)" + half + "," + half + R"(],"scale":[2,2,2])"));
  EXPECT_LT((turned.vertices[1] - Eigen::Vector3d(5, 2, 0)).norm(), 1e-5) << "x becomes y";
  const TriangleMesh mirrored =
      read(scene(R"("POSITION":0},"mode":5)", "", R"(,"scale":[-1,1,1])"));
  EXPECT_EQ(mirrored.faces[0], (Face{0, 2, 1})) << "outward stays outward";
}

TEST_F(GltfReaderTest, ParentsCarryTheirChildren) {
  const std::string json =
      R"("scene":0,"scenes":[{"nodes":[1]}],"nodes":[{"mesh":0,"translation":[1,0,0]},
         {"children":[0],"matrix":[2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,7,1]}],
         "meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":5}]}],"accessors":[)" +
      std::string(kPlaces) + "]";
  EXPECT_EQ(read(json).vertices[0], Eigen::Vector3d(2, 0, 7));
}

TEST_F(GltfReaderTest, MorphWeightsMoveTheirTargets) {
  buffer_ += packed<float>({0, 0, 1, 0,  0, 1, 0, 0, 1, 0, 0, 1,    // all up
                            0, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0});  // the second aside
  const std::string moves = floats("VEC3", 4) + floats("VEC3", 4, 48);
  const std::string targets = R"(,"targets":[{"POSITION":1},{"POSITION":2}])";
  EXPECT_EQ(read(posed("", moves, "", targets)).vertices[1], Eigen::Vector3d(1, 0, 0)) << "at rest";
  const TriangleMesh by_node =
      read(posed(R"(,"weights":[2,0.5],"translation":[0,0,100])", moves, "", targets));
  EXPECT_EQ(by_node.vertices[0], Eigen::Vector3d(0, 0, 102));
  EXPECT_EQ(by_node.vertices[1], Eigen::Vector3d(6, 0, 102));
  std::string by_mesh = posed("", moves, "", targets);
  const std::string mesh = R"("meshes":[{)";
  by_mesh.insert(by_mesh.find(mesh) + mesh.size(), R"("weights":[0,1],)");
  EXPECT_EQ(read(by_mesh).vertices[1], Eigen::Vector3d(11, 0, 0));
  EXPECT_THAT(error(posed(R"(,"weights":[1])", moves, "", targets)),
              HasSubstr("are fewer than the targets"));
}

// A target of one vertex alone, as exporters write it: zeros but for what is sparse.
TEST_F(GltfReaderTest, AccessorsWithoutAViewAreZerosAndWhatIsSparse) {
  buffer_ += packed<std::uint16_t>({2, 0}) + packed<float>({7, 8, 9});
  const std::string sparse =
      R"(,{"componentType":5126,"type":"VEC3","count":4,"sparse":{"count":1,
          "indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":1,"byteOffset":4}}})";
  const TriangleMesh mesh =
      read(posed(R"(,"weights":[1])", sparse, "", R"(,"targets":[{"POSITION":1}])"));
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3d(7, 9, 9));
  EXPECT_EQ(mesh.vertices[1], Eigen::Vector3d(1, 0, 0));
  const std::string zeros = R"(,{"componentType":5126,"type":"VEC3","count":4})";
  EXPECT_EQ(read(posed(R"(,"weights":[1])", zeros, "", R"(,"targets":[{"POSITION":1}])")).vertices,
            read(posed("", "")).vertices);
  std::string only_sparse = posed("", sparse);
  only_sparse.replace(only_sparse.find(R"("POSITION":0)"), 12, R"("POSITION":1)");
  EXPECT_EQ(read(only_sparse).vertices[2], Eigen::Vector3d(7, 8, 9));
  std::string none = posed("", zeros);
  none.replace(none.find(R"("POSITION":0)"), 12, R"("POSITION":1)");
  EXPECT_THAT(error(none), HasSubstr("has no bufferView"));
  std::string huge = only_sparse;
  const std::string few = R"("VEC3","count":4,"sparse")";
  huge.replace(huge.find(few), few.size(), R"("VEC3","count":99999999999,"sparse")");
  EXPECT_THAT(error(huge), HasSubstr("is much more than the file can hold"));
}

TEST_F(GltfReaderTest, JointsMoveTheirSkin) {
  buffer_ += packed<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0});
  buffer_ += packed<float>({1, 0, 0, 0, 0, 1, 0, 0, 0.5, 0.5, 0, 0, 1, 0, 0, 0});
  buffer_ += packed<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1,    // of the first
                            1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -5, 0, 1});  // at y = 5
  const std::string accessors =
      R"(,{"bufferView":1,"componentType":5121,"type":"VEC4","count":4})" + floats("VEC4", 4, 16) +
      floats("MAT4", 2, 80);
  const auto skinned = [&](const std::string& second_joint, const std::string& joints = "[1,2]") {
    std::string json =
        posed(R"(,"skin":0,"translation":[0,0,7000])", accessors, R"(,"JOINTS_0":1,"WEIGHTS_0":2)",
              "", R"(,"skins":[{"joints":)" + joints + R"(,"inverseBindMatrices":3}])");
    const std::string end = R"(}],"meshes")";
    return json.replace(json.find(end), end.size(),
                        R"(},{"translation":[0,0,0]},{"translation":)" + second_joint + end);
  };
  const TriangleMesh rest = read(skinned("[0,5,0]"));
  EXPECT_EQ(rest.vertices[1], Eigen::Vector3d(1, 0, 0)) << "the mesh's own node moves no skin";
  const TriangleMesh moved = read(skinned("[0,5,40]"));
  EXPECT_EQ(moved.vertices[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(moved.vertices[1], Eigen::Vector3d(1, 0, 40));
  EXPECT_EQ(moved.vertices[2], Eigen::Vector3d(0, 1, 20)) << "half by each";
  EXPECT_THAT(error(skinned("[0,5,0]", "[1,7]")), HasSubstr("is no node of the scene"));
  EXPECT_THAT(error(skinned("[0,5,0]", "[1]")), HasSubstr("name joint 1"));
}

TEST_F(GltfReaderTest, QuantizedPlacesAreReadAsTheirNumbers) {
  buffer_ += packed<std::int16_t>({0, 0, 0, 32767, 0, 0, 0, -32767, 0}) +
             packed<std::uint8_t>({0, 0, 0, 200, 0, 0, 0, 100, 0});
  const TriangleMesh mesh = read(
      R"("extensionsUsed":["KHR_mesh_quantization","KHR_texture_transform"],
         "extensionsRequired":["KHR_mesh_quantization","KHR_texture_transform"],
         "nodes":[{"mesh":0,"scale":[3,3,3]}],"meshes":[{"primitives":[
         {"attributes":{"POSITION":0}},{"attributes":{"POSITION":1}}]}],"accessors":[
         {"bufferView":1,"componentType":5122,"normalized":true,"type":"VEC3","count":3},
         {"bufferView":1,"byteOffset":18,"componentType":5121,"type":"VEC3","count":3}])");
  ASSERT_EQ(mesh.vertices.size(), 6u);
  EXPECT_EQ(mesh.vertices[1], Eigen::Vector3d(3, 0, 0)) << "normalised";
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3d(0, -3, 0));
  EXPECT_EQ(mesh.vertices[4], Eigen::Vector3d(600, 0, 0)) << "as it is";
  EXPECT_EQ(said_, "");
}

TEST_F(GltfReaderTest, WhatIsNotFollowedIsSaidOrRefused) {
  EXPECT_EQ(
      read(R"("extensionsUsed":["KHR_materials_clearcoat","KHR_lights_punctual"],)" + posed("", ""))
          .faces.size(),
      2u);
  EXPECT_EQ(said_, "");
  read(R"("extensionsUsed":["ACME_bones","KHR_materials_displacement"],)" + posed("", ""));
  EXPECT_THAT(said_, HasSubstr("uses the extension 'ACME_bones', which is not read"));
  EXPECT_THAT(said_, HasSubstr("'KHR_materials_displacement'"));
  read(R"("animations":[{"channels":[],"samplers":[]}],)" + posed("", ""));
  EXPECT_THAT(said_, HasSubstr("holds animations, which are not followed"));
  EXPECT_THAT(error(R"("extensionsRequired":["ACME_bones"],)" + posed("", "")),
              HasSubstr("'ACME_bones' is not read"));
}

TEST_F(GltfReaderTest, ACircleOfNodesIsRefused) {
  EXPECT_THAT(error(R"("scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{"children":[0]}])"),
              HasSubstr("twice"));
}

TEST_F(GltfReaderTest, RefusesWhatReachesBeyond) {
  const std::string primitive = R"("POSITION":0},"mode":5)";
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string json = scene(primitive, "");
    json.replace(json.find(from), from.size(), to);
    return json;
  };
  EXPECT_THAT(error(with("\"count\":4", "\"count\":5")), HasSubstr("reaches beyond"));
  EXPECT_THAT(error(with("\"count\":4", "\"count\":99999999999")), HasSubstr("reaches beyond"));
  EXPECT_THAT(error(with("\"bufferView\":0", "\"bufferView\":7")), HasSubstr("bufferViews"));
  EXPECT_THAT(error(with("5126", "5127")), HasSubstr("componentType"));
  EXPECT_THAT(error(with("VEC3", "VEC2")), HasSubstr("places in space"));
  EXPECT_THAT(
      error(R"("extensionsRequired":["KHR_draco_mesh_compression"],)" + scene(primitive, "")),
      HasSubstr("KHR_draco_mesh_compression"));
}

TEST_F(GltfReaderTest, AnotherVersionIsRefusedByName) {
  write_bytes(folder_.path() / "a.gltf", R"({"asset":{"version":"1.0"},"meshes":{"a":{}}})");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_gltf(folder_.path() / "a.gltf"); }),
              HasSubstr("/asset/version: is not 2"));
}

TEST_F(GltfReaderTest, ABufferLiesBesideOrBelowItsDocument) {
  write_bytes(folder_.path() / "a.gltf",
              R"({"asset":{"version":"2.0"},"buffers":[{"uri":"../secret","byteLength":4}]})");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_gltf(folder_.path() / "a.gltf"); }),
              HasSubstr("beside or below"));
}

}  // namespace
}  // namespace organbake
