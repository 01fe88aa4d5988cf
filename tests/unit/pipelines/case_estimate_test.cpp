// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/case_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CaseEstimateTest : public testing::Test {
 protected:
  fs::path file(const std::string& name, std::string_view text, std::uintmax_t bytes = 0) {
    write_file_atomically(folder_.path() / name, text);
    if (bytes > 0) fs::resize_file(folder_.path() / name, bytes);
    return folder_.path() / name;
  }
  CaseEstimate estimate(const std::vector<std::string>& settings) {
    return estimate_case(file("r.yaml", "schema: organbake/recipe/1\nname: r\n"), settings);
  }
  TemporaryFolder folder_;
};

TEST_F(CaseEstimateTest, HeadersTellTheVoxels) {
  EXPECT_EQ(voxels_in(file("a.mha", "ObjectType = Image\nDimSize = 57 78 64\n")), 57 * 78 * 64);
  EXPECT_EQ(voxels_in(file("a.nrrd", "NRRD0004\nsizes: 10 20 30\n")), 6000);
  EXPECT_EQ(voxels_in(file("a.nii", "x", 2000)), 1000);
  EXPECT_EQ(voxels_in(file("a.nii.gz", std::string_view("packed\x00\x00\x10\x00", 10))), 1 << 19);
  EXPECT_THROW(voxels_in("none.mha"), NoInputError);
}

TEST_F(CaseEstimateTest, DamagedHeadersAreNoReasonToFail) {
  EXPECT_EQ(voxels_in(file("a.mha", "DimSize = many\n")), 7.5);
  EXPECT_EQ(voxels_in(file("a.nii.gz", "xy")), 1);
}

TEST_F(CaseEstimateTest, ABiggerInputNeedsMore) {
  const fs::path small = file("s.nii", "x", 1'000'000), big = file("b.nii", "x", 1'000'000'000);
  const CaseEstimate less = estimate({"ct=" + small.string()});
  const CaseEstimate more = estimate({"ct=" + big.string()});
  EXPECT_EQ(less.flaw, "");
  EXPECT_GT(less.cpu_seconds, 0);
  EXPECT_GT(more.cpu_seconds, less.cpu_seconds);
  EXPECT_GT(more.memory_mb, 1000);  // two bytes a voxel are read, at the least
  EXPECT_LT(less.memory_mb, 1000);
}

TEST_F(CaseEstimateTest, FewerFramesAndSmallerMapsNeedLess) {
  const std::string clip = "frames=" + file("c.mp4", "x", 50'000'000).string();
  const CaseEstimate all = estimate({clip});
  EXPECT_LT(estimate({clip, "shade.every=25"}).cpu_seconds, all.cpu_seconds);
  EXPECT_LT(estimate({clip, "place.size_px=64"}).memory_mb,
            estimate({clip, "place.size_px=4096"}).memory_mb);
}

TEST_F(CaseEstimateTest, SaysWhyNothingCanBeTold) {
  EXPECT_THAT(estimate({"ct=/none.mha"}).flaw, HasSubstr("/none.mha"));
  EXPECT_THAT(estimate({"ct=/none.mha", "decimate.facez=3"}).flaw, HasSubstr("facez"));
  EXPECT_THAT(estimate({}).flaw, HasSubstr("lacks its input"));
}

}  // namespace
}  // namespace organbake
