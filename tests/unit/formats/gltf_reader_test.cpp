// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/gltf_reader.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>

#include "file_bytes.h"
#include "organbake/core/temporary_folder.h"

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
    return read_gltf(folder_.path() / "a.gltf");
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
  TemporaryFolder folder_;
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

TEST_F(GltfReaderTest, ABufferLiesBesideOrBelowItsDocument) {
  write_bytes(folder_.path() / "a.gltf",
              R"({"asset":{"version":"2.0"},"buffers":[{"uri":"../secret","byteLength":4}]})");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_gltf(folder_.path() / "a.gltf"); }),
              HasSubstr("beside or below"));
}

}  // namespace
}  // namespace organbake
