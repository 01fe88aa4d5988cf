// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/content_hash.h"

#include <gtest/gtest.h>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class ContentHashTest : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    fs::create_directories((path() / name).parent_path());
    write_file_atomically(path() / name, text);
  }
  std::string hash(InputKind kind, const std::string& name) {
    return content_hash(files_of_input(kind, path() / name), quick_hash_of_file);
  }
  fs::path path() const { return folder_.path(); }

  TemporaryFolder folder_;
};

TEST(QuickHash, IsXxh3) {
  // XXH3-128 of nothing with seed 0, from the reference implementation's own vectors.
  EXPECT_EQ(quick_hash(""), "99aa06d3014798d86001c324468d497f");
}

TEST_F(ContentHashTest, AFilesNameDoesNotCount) {
  write("a.ply", "same");
  write("b.ply", "same");
  write("c.ply", "other");
  EXPECT_EQ(hash(InputKind::mesh, "a.ply"), hash(InputKind::mesh, "b.ply"));
  EXPECT_NE(hash(InputKind::mesh, "a.ply"), hash(InputKind::mesh, "c.ply"));
}

TEST_F(ContentHashTest, FilesLongerThanABlockAreReadToTheEnd) {
  std::string text(1000000, 'x');
  write("long", text);
  EXPECT_EQ(hash(InputKind::mesh, "long"), quick_hash(text));
  const std::string before = hash(InputKind::mesh, "long");
  text.back() = 'y';
  write("long", text);
  EXPECT_NE(hash(InputKind::mesh, "long"), before);
}

TEST_F(ContentHashTest, InAFolderNamesAndContentsCount) {
  write("s/1.dcm", "one");
  write("s/sub/2.dcm", "two");
  const std::string before = hash(InputKind::volume, "s");
  EXPECT_EQ(hash(InputKind::volume, "s"), before);
  fs::rename(path() / "s/1.dcm", path() / "s/0.dcm");
  EXPECT_NE(hash(InputKind::volume, "s"), before);
  fs::rename(path() / "s/0.dcm", path() / "s/1.dcm");
  write("s/1.dcm", "One");
  EXPECT_NE(hash(InputKind::volume, "s"), before);
}

TEST_F(ContentHashTest, AHeadersDataFileCounts) {
  write("v.mhd", "NDims = 3\nElementDataFile = v.raw\n");
  write("v.raw", "voxels");
  write("w.nhdr", "NRRD0004\ndata file: v.raw\n");
  const std::string before = hash(InputKind::volume, "v.mhd");
  const std::string nrrd_before = hash(InputKind::volume, "w.nhdr");
  write("v.raw", "Voxels");
  EXPECT_NE(hash(InputKind::volume, "v.mhd"), before);
  EXPECT_NE(hash(InputKind::volume, "w.nhdr"), nrrd_before);
  write("l.mhd", "ElementDataFile = LIST\nv.raw\n");
  const std::string list_before = hash(InputKind::volume, "l.mhd");
  write("v.raw", "voxels!");
  EXPECT_NE(hash(InputKind::volume, "l.mhd"), list_before);
}

TEST_F(ContentHashTest, BothFilesOfAPairCountWhicheverIsNamed) {
  write("a.hdr", "header");
  write("a.img", "voxels");
  const std::string before = hash(InputKind::volume, "a.hdr");
  EXPECT_EQ(hash(InputKind::volume, "a.img"), before);
  write("a.img", "others");
  EXPECT_NE(hash(InputKind::volume, "a.hdr"), before);
}

TEST_F(ContentHashTest, OneSliceStandsForWhatLiesBesideIt) {
  const std::string dicom = std::string(128, '\0') + "DICM";
  write("s/1", dicom + "one");
  write("s/2", dicom + "two");
  const std::string before = hash(InputKind::volume, "s/1");
  EXPECT_NE(hash(InputKind::volume, "s/2"), before) << "another series may be meant";
  write("s/2", dicom + "three");
  EXPECT_NE(hash(InputKind::volume, "s/1"), before);
}

TEST_F(ContentHashTest, ThePhotographsOfADocumentCount) {
  CameraSet set;
  set.cameras.resize(1);
  set.cameras[0].name = "p";
  set.cameras[0].intrinsics = {.width = 4, .height = 4, .fx = 1, .fy = 1, .cx = 2, .cy = 2};
  set.images = {"p.png"};
  write("p/cameras.json", cameras_to_json(set));
  EXPECT_THROW(hash(InputKind::photos, "p/cameras.json"), NoInputError) << "its image is missing";
  write("p/p.png", "pixels");
  const std::string before = hash(InputKind::photos, "p/cameras.json");
  write("p/p.png", "Pixels");
  EXPECT_NE(hash(InputKind::photos, "p/cameras.json"), before);
}

TEST_F(ContentHashTest, TheBuffersOfAGltfDocumentCount) {
  write("m/a.gltf", R"({"buffers":[{"uri":"a%20b.bin"},{"uri":"data:;base64,AA=="},{}]})");
  write("m/a b.bin", "places");
  const std::string before = hash(InputKind::mesh, "m/a.gltf");
  write("m/a b.bin", "Places");
  EXPECT_NE(hash(InputKind::mesh, "m/a.gltf"), before);
  write("m/b.gltf", "no JSON");
  EXPECT_NO_THROW(hash(InputKind::mesh, "m/b.gltf")) << "its reader tells why";
}

TEST_F(ContentHashTest, AllFilesOfAColmapModelCountWhicheverIsNamed) {
  for (const char* name : {"cameras", "images", "rigs", "frames"})
    write("c/" + std::string(name) + ".txt", name);
  for (const char* changed : {"cameras", "rigs", "frames"}) {
    const std::string before = hash(InputKind::posed, "c/images.txt");
    write("c/" + std::string(changed) + ".txt", "changed");
    EXPECT_NE(hash(InputKind::posed, "c/images.txt"), before) << changed;
  }
}

TEST_F(ContentHashTest, WhatIsNotThereIsRefused) {
  EXPECT_THROW(files_of_input(InputKind::mesh, path() / "missing"), NoInputError);
  fs::create_directory(path() / "empty");
  EXPECT_THROW(files_of_input(InputKind::volume, path() / "empty"), NoInputError);
  EXPECT_THROW(files_of_input(InputKind::mesh, path() / "empty"), NoInputError);
  EXPECT_THROW(files_of_input(InputKind::mesh, "/dev/null"), NoInputError);
}

}  // namespace
}  // namespace organbake
