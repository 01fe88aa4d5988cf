// SPDX-License-Identifier: GPL-3.0-or-later
// The kind of a volume by its content; zips, packed bytes and VTK's images.
#include "organbake/volume/read_volume.h"

#include <minizip/zip.h>

#include "files/volume_files.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "support/error_message.h"
#include "support/files.h"
#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

class ReadVolume : public ::testing::Test {
 protected:
  std::string error(ExitCode code, const std::string& name) {
    return message_of(code, [&] { read_volume(folder_.path() / name); });
  }
  TemporaryFolder folder_;
};

TEST_F(ReadVolume, TellsTheKindByContentNotByName) {
  const Volume truth = ramp_volume();
  write_bytes(folder_.path() / "nifti", NiftiBytes(truth).bytes());
  write_bytes(folder_.path() / "nifti.mha", gzipped(NiftiBytes(truth).bytes()));
  EXPECT_EQ(read_volume(folder_.path() / "nifti").voxels, truth.voxels);
  EXPECT_EQ(read_volume(folder_.path() / "nifti.mha").voxels, truth.voxels);
}

TEST_F(ReadVolume, WhatIsNotThereIsNoInput) {
  EXPECT_THAT(error(ExitCode::no_input, "gone.nii.gz"), HasSubstr("does not exist"));
  std::filesystem::create_directory(folder_.path() / "empty");
  EXPECT_THAT(error(ExitCode::no_input, "empty"), HasSubstr("holds no files"));
  std::filesystem::create_directory(folder_.path() / "texts");
  write_bytes(folder_.path() / "texts/a.txt", "hello");
  write_bytes(folder_.path() / "texts/b.csv", std::string(1000, 'b'));
  EXPECT_THAT(error(ExitCode::no_input, "texts"), HasSubstr("no DICOM image among its 2 files"));
  std::filesystem::create_directories(folder_.path() / "study/series");
  EXPECT_THAT(error(ExitCode::no_input, "study"), HasSubstr("give the subfolder"));
}

TEST_F(ReadVolume, WhatIsNoVolumeIsBadData) {
  write_bytes(folder_.path() / "empty.nii", "");
  EXPECT_THAT(error(ExitCode::bad_data, "empty.nii"), HasSubstr("is empty"));
  write_bytes(folder_.path() / "note.txt", "just some words");
  EXPECT_THAT(error(ExitCode::bad_data, "note.txt"), HasSubstr("is not a volume"));
  write_bytes(folder_.path() / "scan.vtk", "# vtk DataFile Version 3.0\nscan\nASCII\n");
  EXPECT_THAT(error(ExitCode::bad_data, "scan.vtk"), HasSubstr("save it as .vti"));
  write_bytes(folder_.path() / "a.gz", gzipped("just some words"));
  EXPECT_THAT(error(ExitCode::bad_data, "a.gz"), HasSubstr("too short for a NIfTI header"));
  DicomBytes slice;
  slice.pixels.assign(12, 0);
  write_bytes(folder_.path() / "slice", slice.bytes());
  EXPECT_THAT(error(ExitCode::bad_data, "slice"), HasSubstr("the only CT slice"));
}

TEST_F(ReadVolume, CancelledBeforeItBegins) {
  const std::atomic<bool> cancel = true;
  const RunContext context({}, {}, &cancel);
  EXPECT_THROW(read_volume(folder_.path(), context), CancelledError);
}

namespace fs = std::filesystem;

void write_zip(const fs::path& path,
               const std::vector<std::pair<std::string, std::string>>& files) {
  zipFile zip = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
  for (const auto& [name, bytes] : files) {
    zip_fileinfo info{};
    zipOpenNewFileInZip64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6,
                          0);
    zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size()));
    zipCloseFileInZip(zip);
  }
  zipClose(zip, nullptr);
}

class ZippedSeries : public DicomFolderTest {
 protected:
  ZippedSeries() { add_stack({0, 2, 4}, Eigen::Matrix3d::Identity()); }
  std::string slice(int number) const {
    const auto bytes = read_file(folder_.path() / ("slice" + std::to_string(number)));
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  // In two folders, as a disc has them, with what macOS and people add.
  std::vector<std::pair<std::string, std::string>> packed() const {
    return {{"IMG/a/0001", slice(1)},
            {"IMG/a/0002", slice(2)},
            {"IMG/b/0001", slice(3)},
            {"IMG/b/", ""},
            {"__MACOSX/IMG/a/._0001", "companion"},
            {"read me.txt", "a note"}};
  }
  std::string refusal() const {
    return message_of(ExitCode::bad_data, [&] { read_volume(zip_, VolumeReadOptions{}); });
  }
  TemporaryFolder beside_;
  fs::path zip_ = beside_.path() / "series.zip";
};

TEST_F(ZippedSeries, IsReadAsItsFolder) {
  write_zip(zip_, packed());
  const Volume zipped = read_volume(zip_, VolumeReadOptions{}), loose = read();
  EXPECT_EQ(zipped.voxels, loose.voxels);
  EXPECT_EQ(zipped.origin_mm, loose.origin_mm);
  EXPECT_EQ(zipped.size, loose.size);
  for (const std::string& warning : zipped.warnings)
    EXPECT_EQ(warning.find("organbake-"), std::string::npos) << "a temporary folder: " << warning;
}

TEST_F(ZippedSeries, WhatIsNoneIsRefusedByItsName) {
  write_zip(zip_, {{"note.txt", "no scan"}});
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("series.zip"), HasSubstr("is not a volume")));
  write_zip(zip_, {{"a.txt", "no scan"}, {"b.txt", "either"}});
  EXPECT_THAT(refusal(), HasSubstr("series.zip"));
  write_zip(zip_, {{"__MACOSX/._a", "x"}});
  EXPECT_THAT(refusal(), HasSubstr("without files"));
  const TemporaryFolder inner;
  write_zip(inner.path() / "in.zip", packed());
  write_zip(zip_, {{"in.zip", read_text_file(inner.path() / "in.zip")}});
  EXPECT_THAT(refusal(), HasSubstr("another zip"));
}

TEST_F(ZippedSeries, NothingIsWrittenOutsideItsFolder) {
  std::vector<std::pair<std::string, std::string>> files = packed();
  files.push_back({"../../../escaped", slice(1)});
  write_zip(zip_, files);
  const UnzippedFolder unzipped(zip_);
  EXPECT_EQ(list_files(unzipped.path()).size(), 5u);
  EXPECT_FALSE(fs::exists(unzipped.path().parent_path() / "escaped"));
}

TEST_F(ZippedSeries, ADamagedZipIsRefused) {
  write_zip(zip_, packed());
  const std::vector<std::byte> good = read_file(zip_);
  for (const std::size_t cut :
       {std::size_t{22}, std::size_t{60}, good.size() / 2}) {  // 22: the end record
    write_file_atomically(zip_, std::span(good).first(good.size() - cut));
    EXPECT_THAT(refusal(), HasSubstr("series.zip"));
  }
  std::vector<std::byte> bad = good;
  bad[60] ^= std::byte{0x55};  // within the first file's bytes: its checksum tells
  write_file_atomically(zip_, bad);
  EXPECT_THAT(refusal(), HasSubstr("damaged zip"));
}

class ByteStreams : public ::testing::Test {
 protected:
  std::string read(ByteStream& stream, std::size_t count) {
    std::string text(count, '\0');
    text.resize(stream.read(std::as_writable_bytes(std::span(text))));
    return text;
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "bytes";
};

TEST_F(ByteStreams, GzipMembersFollowOneAnother) {
  std::string large(1000000, 'x');
  large[999999] = 'y';
  write_bytes(file_, gzipped("one,") + gzipped(large) + std::string(5, '\0'));
  ByteStream stream(file_, ByteStream::Coding::deflate);
  EXPECT_EQ(read(stream, 4), "one,");
  EXPECT_EQ(read(stream, 2000000), large);
}

TEST_F(ByteStreams, OtherBytesAreNoCompressedData) {
  write_bytes(file_, "neither gzip nor bzip2");
  for (const auto coding : {ByteStream::Coding::deflate, ByteStream::Coding::bzip2}) {
    ByteStream stream(file_, coding);
    EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(stream, 1); }), HasSubstr("damaged"));
  }
}

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

class Vti : public VolumeFileTest {
 protected:
  Vti() : VolumeFileTest("scan.vti") {}
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
