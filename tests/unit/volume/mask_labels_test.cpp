// SPDX-License-Identifier: GPL-3.0-or-later
#include "labels/mask_labels.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "organbake/volume/label_figures.h"
#include "organbake/volume/label_names_file.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Two segments that overlap, in two layers, as 3D Slicer saves them: the fastest axis is the list.
class Layers : public ::testing::Test {
 protected:
  static std::string segment(int i, const std::string& name, int layer) {
    const std::string key = "Segment" + std::to_string(i) + "_";
    return key + "ID:=S_" + std::to_string(i) + "\n" + key + "Name:=" + name + "\n" + key +
           "LabelValue:=1\n" + key + "Layer:=" + std::to_string(layer) + "\n";
  }
  Layers() {
    std::string voxels;
    for (int i = 0; i < 60; ++i) {
      voxels += static_cast<char>(i < 20);             // "box": the first slice
      voxels += static_cast<char>(i >= 10 && i < 50);  // "big organ": overlaps it
    }
    write_bytes(file_,
                "NRRD0004\ntype: uchar\ndimension: 4\nspace: left-posterior-superior\n"
                "sizes: 2 5 4 3\nspace directions: none (1,0,0) (0,1,0) (0,0,2)\n"
                "kinds: list domain domain domain\nencoding: raw\nspace origin: (1,2,3)\n" +
                    segment(0, "box", 0) + segment(1, "big organ", 1) + "\n" + voxels);
  }
  Volume read(const std::string& label) { return read_volume(file_, {.label = label}); }
  std::string error(const std::string& label) {
    return message_of(ExitCode::bad_data, [&] { read(label); });
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "two.seg.nrrd";
};

TEST_F(Layers, ASegmentComesByNameOutOfItsLayer) {
  const Volume box = read("box");
  EXPECT_EQ(label_figures(box)[0].voxels, 20u);
  EXPECT_EQ(label_figures(box)[0].max_mm, Eigen::Vector3d(5, 5, 3)) << "the first slice alone";
  const Volume organ = read("Big_Organ");
  EXPECT_EQ(label_figures(organ)[0].voxels, 40u);
  EXPECT_NEAR(label_figures(organ)[0].volume_ml, 0.08, 1e-12);
  EXPECT_EQ(organ.at(4, 1, 1), 1);
  EXPECT_EQ(organ.at(4, 1, 0), 0);
}

TEST_F(Layers, SegmentsTogetherAreTheirUnion) {
  EXPECT_EQ(label_figures(read("box, big organ"))[0].voxels, 50u);
}

TEST_F(Layers, ANumberThatSeveralLayersHaveIsRefusedWithTheNames) {
  EXPECT_THAT(error("1"), HasSubstr("choose by name: 1 box, 1 big organ"));
  EXPECT_THAT(error("liver"), HasSubstr("it holds 1 box, 1 big organ"));
}

TEST(Labels, TwoOfOneNameAreAQuestion) {
  const std::vector<LabelName> names = {
      {3, "lobe", 0}, {7, "lobe", 1}, {8, "Vein", 2}, {9, "vein", 3}};
  const auto error = [&](const char* text) {
    return message_of(ExitCode::bad_data, [&] { chosen_labels(text, names, "f"); });
  };
  EXPECT_THAT(error("lobe"), HasSubstr("the labels 3 and 7 are both called \"lobe\""));
  EXPECT_EQ(chosen_labels("7", names, "f").front().layer, 1);
  EXPECT_EQ(chosen_labels("vein", names, "f").front().label, 9) << "its very name";
  EXPECT_THAT(error("VEIN"), HasSubstr("the labels 8 and 9"));
  EXPECT_EQ(chosen_labels("a", {{1, "a"}, {1, "a"}}, "f").size(), 1u) << "one label, told twice";
}

TEST(Labels, ARegionIsAllOfItsLabels) {
  const std::vector<LabelName> names = {{1, "kidneys", 0, {2}}, {2, "right", 0}};
  const auto chosen = chosen_labels("kidneys", names, "f");
  ASSERT_EQ(chosen.size(), 2u);
  EXPECT_EQ(chosen[1].label, 2);
}

TEST(Labels, NumbersAndNamesAreChecked) {
  const std::vector<LabelName> names = {{3, "a, b", 0}, {4, "c", 0}};
  EXPECT_EQ(chosen_labels("a, b", names, "f").size(), 1u) << "a comma in a name";
  EXPECT_EQ(chosen_labels(" 4 ,c,3", names, "f").size(), 2u) << "twice the same";
  EXPECT_EQ(chosen_labels("c,a, b", names, "f").size(), 2u) << "among others, too";
  EXPECT_EQ(chosen_labels("A_,B,4", names, "f").front().label, 3);
  EXPECT_THAT(message_of(ExitCode::usage, [&] { chosen_labels("0", names, "f"); }),
              HasSubstr("must be 1…16777216"));
  EXPECT_THAT(message_of(ExitCode::usage, [&] { chosen_labels("16777217", names, "f"); }),
              HasSubstr("must be 1…16777216"));
  EXPECT_THAT(message_of(ExitCode::usage, [&] { chosen_labels(" , ", names, "f"); }),
              HasSubstr("empty"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { chosen_labels("x", {}, "f"); }),
              HasSubstr("have no names"));
}

TEST(Labels, NamesComeFromTheTextsThatEditorsWrite) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "labels.txt";
  const auto read = [&](const std::string& text) {
    write_bytes(file, text);
    return read_label_names(file);
  };
  const auto snap = read(
      "# ITK-SnAP Label Description File\n    0     0    0    0        0  0  0    \"Clear Label\"\n"
      "    5   255    0    0        1  1  1    \"left kidney\"\r\n");
  ASSERT_EQ(snap.size(), 1u);
  EXPECT_EQ(snap[0].label, 5);
  EXPECT_EQ(snap[0].name, "left kidney");
  const auto slicer = read("# Color table\n1 liver 221 130 101 255\n2 gall_bladder 1 2 3 255\n");
  ASSERT_EQ(slicer.size(), 2u);
  EXPECT_EQ(slicer[1].name, "gall_bladder");
  EXPECT_EQ(read("7: spleen\n")[0].name, "spleen");
  const auto columns = read("1;pu;putamen;255;0;12\n2;\"cd\";\"caudate; head\";1;2;3\n");
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_EQ(columns[0].name, "putamen");
  EXPECT_EQ(columns[1].label, 2);
  EXPECT_EQ(columns[1].name, "caudate; head");
  const auto quoted =
      read("\"index\",\"short\",\"name\"\n\"3\",\"hippocampus left\",\"HL, left\"\n");
  ASSERT_EQ(quoted.size(), 1u);
  EXPECT_EQ(quoted[0].label, 3);
  EXPECT_EQ(quoted[0].name, "HL, left");
  EXPECT_EQ(read("label,name\n4,left kidney\n")[0].name, "left kidney");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read("1;liver\n;spleen\n"); }),
              HasSubstr("line 2 \";spleen\" is no label"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read("1 liver\nspleen\n"); }),
              HasSubstr("line 2 \"spleen\" is no label"));
}

TEST(Labels, NamesComeFromTheDatasetOfNnUnet) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "dataset.json";
  const auto read = [&](const std::string& labels) {
    write_bytes(file, "{\"channel_names\": {\"0\": \"CT\"}, \"labels\": " + labels + "}");
    return read_label_names(file);
  };
  const auto second = read(R"({"background": 0, "whole": [1, 2], "liver": 1, "ignore": 3})");
  ASSERT_EQ(second.size(), 3u);
  EXPECT_EQ(chosen_labels("liver", second, "f").front().label, 1);
  EXPECT_EQ(chosen_labels("whole", second, "f").size(), 2u);
  const auto first = read(R"({"0": "background", "1": "liver", "12": "spleen"})");
  ASSERT_EQ(first.size(), 2u);
  EXPECT_EQ(first[1].label, 12);
  EXPECT_EQ(first[1].name, "spleen");
  for (const char* broken : {"3", R"({"a": "b"})", R"({"a": [1, "b"]})", R"({"a": 1.5})", "{"})
    EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(broken); }), HasSubstr("dataset.json"));
}

}  // namespace
}  // namespace organbake
