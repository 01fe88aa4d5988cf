// SPDX-License-Identifier: GPL-3.0-or-later
// Labels by name and number, tables of their names, their boxes, and whether they fit their CT.
#include "files/volume_files.h"

#include "organbake/core/temporary_files.h"
#include "organbake/volume/read_volume.h"
#include "support/files.h"
#include "support/testing.h"

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

// Label 3 in two voxels of 11 × 11 × 11, whose first lies at (−5, −5, −5) mm.
Volume two_voxels() {
  Volume mask;
  mask.size = {11, 11, 11};
  mask.origin_mm = {-5, -5, -5};
  mask.voxels.assign(11 * 11 * 11, 0);
  mask.voxels[(6 * 11 + 4) * 11 + 2] = 3;
  mask.voxels[(10 * 11 + 1) * 11 + 3] = 3;
  return mask;
}

TEST(LabelBox, HoldsTheLabelAlone) {
  const Volume mask = two_voxels();
  EXPECT_EQ(bounding_box(mask, 2).label_voxels, 0u);
  const LabelBox box = bounding_box(mask, 3);
  EXPECT_EQ(box.label_voxels, 2u);
  EXPECT_EQ(box.first, (std::array<int, 3>{2, 1, 6}));
  EXPECT_EQ(box.size, (std::array<int, 3>{2, 4, 5}));
}

TEST(LabelBox, RegionAroundItReachesTwoVoxelsOnAlongTurnedAxes) {
  Volume mask = two_voxels();
  mask.direction.col(0) = -Eigen::Vector3d::UnitX();
  const Region region = region_around(mask, bounding_box(mask, 3));
  EXPECT_EQ(region.min_mm, Eigen::Vector3d(-5 - 5, -5 + 1 - 2, -5 + 6 - 2));
  EXPECT_EQ(region.max_mm, Eigen::Vector3d(-5 - 0, -5 + 4 + 2, -5 + 10 + 2));
}

using ::testing::IsEmpty;

constexpr int kFirstOrganSlice = 25, kOrgan = 5;

// 40 slices of air with an organ of 50 HU in ten of them, beside bone.
Volume small_ct() {
  Volume ct;
  ct.size = {16, 16, 40};
  ct.spacing_mm = {2, 2, 3};
  ct.voxels.assign(16 * 16 * 40, -1000);
  for (int k = kFirstOrganSlice; k < kFirstOrganSlice + 10; ++k) {
    for (int j = 4; j < 12; ++j)
      for (int i = 4; i < 12; ++i)
        ct.voxels[std::size_t(k * 16 + j) * 16 + i] = static_cast<std::int16_t>(45 + (i + j) % 11);
  }
  return ct;
}

// The organ's mask, cropped to its own slices.
Volume cropped_mask(const Volume& ct) {
  Volume mask = ct;
  mask.size[2] = 10;
  mask.voxels.resize(16 * 16 * 10);
  for (std::size_t v = 0; v < mask.voxels.size(); ++v)
    mask.voxels[v] = ct.voxels[v + 256 * kFirstOrganSlice] > 0 ? kOrgan : 0;
  mask.origin_mm = ct.world_from_index({0, 0, kFirstOrganSlice});
  return mask;
}

TEST(MaskCheck, AMaskInItsPlaceIsPlausible) {
  const Volume ct = small_ct();
  const MaskCheck check = check_mask(ct, cropped_mask(ct), kOrgan);
  EXPECT_TRUE(check.plausible);
  EXPECT_FALSE(check.grids_equal);
  EXPECT_EQ(check.overlap_share, 1);
  EXPECT_EQ(check.fit.soft_tissue_share, 1);
  EXPECT_THAT(check.message, IsEmpty());
}

// Gas below the organ: moved onto it the label would fit, but the organ's own label no longer.
TEST(MaskCheck, AGutFullOfGasIsNotMovedWhereTheOtherLabelsFit) {
  const Volume ct = small_ct();
  Volume mask = ct;
  constexpr int kFirst = kFirstOrganSlice - 10;
  mask.size[2] = 20;
  mask.voxels.resize(16 * 16 * 20);
  for (std::size_t v = 0; v < mask.voxels.size(); ++v)
    mask.voxels[v] = ct.voxels[v % 2560 + 256 * kFirstOrganSlice] <= 0 ? 0 : v < 2560 ? 7 : 5;
  mask.origin_mm = ct.world_from_index({0, 0, kFirst});
  constexpr int gut = 7;
  const MaskCheck check = check_mask(ct, mask, gut);
  EXPECT_FALSE(check.plausible);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("label 7 lies on soft tissue"));
  EXPECT_THAT(check.message, HasSubstr("That is right for bone, lung or gut"));
  std::replace(mask.voxels.begin(), mask.voxels.end(), std::int16_t{5}, std::int16_t{0});
  EXPECT_TRUE(check_mask(ct, mask, gut).better);
}

TEST(MaskCheck, ACropThatKeptTheScansOriginIsFoundAndItsPlaceNamed) {
  const Volume ct = small_ct();
  Volume mask = cropped_mask(ct);
  mask.origin_mm = ct.origin_mm;
  const MaskCheck check = check_mask(ct, mask, kOrgan);
  EXPECT_FALSE(check.plausible);
  ASSERT_TRUE(check.better);
  EXPECT_EQ(check.better->slices, kFirstOrganSlice);
  EXPECT_LT((check.better->shift_world_mm - Eigen::Vector3d(0, 0, 75)).norm(), 1e-9);
  EXPECT_THAT(check.message, HasSubstr("Its header repeats the CT's origin"));
  EXPECT_THAT(check.message, HasSubstr("(0.0, 0.0, 75.0) mm (LPS)"));
  mask.origin_mm += check.better->shift_world_mm;
  EXPECT_TRUE(check_mask(ct, mask, kOrgan).plausible);
}

TEST(MaskCheck, AMaskOfAnotherPlaceGetsBothPlacesTold) {
  const Volume ct = small_ct();
  Volume mask = cropped_mask(ct);
  mask.origin_mm.x() += 5000;
  const MaskCheck check = check_mask(ct, mask, kOrgan);
  EXPECT_EQ(check.overlap_share, 0);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("no voxel of label 5 lies inside the CT"));
}

TEST(MaskCheck, OnTheCtsOwnGridNoMoveIsProposed) {
  const Volume ct = small_ct();
  Volume mask = ct;
  for (std::size_t v = 0; v < mask.voxels.size(); ++v) mask.voxels[v] = v < 5000 ? 5 : 0;
  const MaskCheck check = check_mask(ct, mask, kOrgan);
  EXPECT_TRUE(check.grids_equal);
  EXPECT_FALSE(check.plausible);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("right for bone, lung or gut"));
}

TEST(MaskCheck, AnAbsentLabelIsRefusedWithThoseThatAreThere) {
  const Volume ct = small_ct();
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { check_mask(ct, cropped_mask(ct), 6); }),
              HasSubstr("no label 6; it holds 5"));
}

TEST(MaskCheckRealData, TheAbdomenMasksWrongOriginIsFound) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_seg.nii.gz");
  const Volume ct = read_volume(shared_data("ct/abdomen/example_ct.nii.gz"));
  Volume mask = read_volume(shared_data("ct/abdomen/example_seg.nii.gz"));
  const MaskCheck check = check_mask(ct, mask, kOrgan);
  EXPECT_FALSE(check.plausible);
  ASSERT_TRUE(check.better);
  EXPECT_EQ(check.better->slices, 82);  // the data's README: slices 82…111 of the CT
  mask.origin_mm += check.better->shift_world_mm;
  const MaskCheck moved = check_mask(ct, mask, kOrgan);
  EXPECT_TRUE(moved.plausible);
  EXPECT_LT(moved.fit.deviation_hu, 20);  // a liver, not a mixture
}

TEST(MaskCheckRealData, TheDicomMaskSitsOnItsLiver) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct_dicom");
  const Volume& ct = dicom_abdomen();
  const Volume mask = read_volume(shared_data("ct/abdomen/example_seg_dicom.nii.gz"));
  const MaskCheck check = check_mask(ct, mask, kOrgan);
  EXPECT_TRUE(check.plausible) << check.message;
  EXPECT_NEAR(check.fit.mean_hu, 90, 20);  // liver in the portal phase
}

}  // namespace
}  // namespace organbake
