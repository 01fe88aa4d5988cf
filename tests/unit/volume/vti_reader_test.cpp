// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/vti_reader.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr double kVtiRounding_hu = 0.5 + 1e-6;

struct VtiText {
  Volume volume = ramp_volume(oblique_direction());
  std::array<int, 3> first_index = {0, 0, 0};
  std::string type = "Int16";
  int components = 1;
  std::string array = "PointData";

  std::string text() const {
    std::string extent, direction, values;
    for (int axis = 0; axis < 3; ++axis) {
      extent += std::to_string(first_index[axis]) + " " +
                std::to_string(first_index[axis] + volume.size[axis] - 1) + " ";
      for (int c = 0; c < 3; ++c) direction += to_text(volume.direction(axis, c)) + " ";
    }
    for (const std::int16_t v : volume.voxels) values += std::to_string(v) + " ";
    const Eigen::Vector3d at =
        volume.world_from_index(-Eigen::Vector3d(first_index[0], first_index[1], first_index[2]));
    const auto vector = [](const Eigen::Vector3d& v) {
      return to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z());
    };
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
           "byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"" +
           extent + "\" Origin=\"" + vector(at) + "\" Spacing=\"" + vector(volume.spacing_mm) +
           "\" Direction=\"" + direction + "\">\n<Piece Extent=\"" + extent + "\">\n<" + array +
           ">\n<DataArray type=\"" + type + "\" Name=\"hu\" NumberOfComponents=\"" +
           std::to_string(components) + "\" format=\"ascii\">\n" + values + "\n</DataArray>\n</" +
           array + ">\n</Piece>\n</ImageData>\n</VTKFile>\n";
  }
};

class Vti : public ::testing::Test {
 protected:
  Volume read(const std::string& text) {
    write_bytes(file_, text);
    return read_volume(file_);
  }
  std::string error(const std::string& text) {
    return message_of(ExitCode::bad_data, [&] { read(text); });
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "scan.vti";
};

TEST_F(Vti, DirectionAndExtentPutEveryVoxelInItsPlace) {
  VtiText vti;
  EXPECT_LT(largest_ramp_error(read(vti.text())), kVtiRounding_hu);
  vti.first_index = {-3, 2, 7};
  EXPECT_LT(largest_ramp_error(read(vti.text())), kVtiRounding_hu);
}

TEST_F(Vti, OtherNumberTypesAreConverted) {
  for (const char* type : {"Float32", "Float64", "Int32", "Int64"}) {
    VtiText vti;
    vti.type = type;
    EXPECT_EQ(read(vti.text()).voxels, vti.volume.voxels) << type;
  }
}

TEST_F(Vti, DamagedFilesAreRefusedByName) {
  VtiText several;
  several.components = 3;
  several.volume.voxels.resize(180);
  EXPECT_THAT(error(several.text()), HasSubstr("3 values per voxel"));
  VtiText none;
  none.array = "CellData";
  none.volume.voxels.resize(2 * 3 * 4);
  EXPECT_THAT(error(none.text()), HasSubstr("no point scalars"));
  const std::string whole = VtiText().text();
  EXPECT_THAT(error(whole.substr(0, whole.size() / 2)), HasSubstr("scan.vti"));
  EXPECT_THAT(error("<VTKFile type=\"PolyData\"></VTKFile>"), HasSubstr("scan.vti"));
  EXPECT_THAT(error("nonsense"), HasSubstr("scan.vti"));
}

}  // namespace
}  // namespace organbake
