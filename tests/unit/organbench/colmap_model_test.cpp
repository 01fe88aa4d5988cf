// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "peers/colmap.h"

namespace organbake {
namespace {

// Three cameras side by side, a unit apart, looking along z.
constexpr const char* kCameras = "1 PINHOLE 100 100 50 50 50 50\n";
constexpr const char* kImages =
    "# comment\n"
    "1 1 0 0 0 0 0 0 1 a_000000.png\n55.5 50 1\n"
    "2 1 0 0 0 -1 0 0 1 a_000005.png\n50 50.5 1 49 50 2\n"
    "7 1 0 0 0 -2 0 0 1 a_000010.png\n45 50 1\n";

TEST(ColmapModel, PointsCarryTheirSightingsAndAngles) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "cameras.txt", std::string_view(kCameras));
  write_file_atomically(folder.path() / "images.txt", std::string_view(kImages));
  write_file_atomically(folder.path() / "points3D.txt",
                        std::string_view("# comment\n"
                                         "1 1 0 10 200 100 90 0 1 0 2 0 7 0\n"
                                         "2 0 0 50 200 100 90 0.9 2 1 2 0\n"
                                         "3 1 0 1000 0 0 0 0.1 1 0 2 0 7 0\n"
                                         "4 1 0 10 0 0 0 0.7\n"));
  const std::vector<ModelPoint> points = read_model_points(folder.path());
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(points[0].sightings, 3u);
  EXPECT_NEAR(points[0].largest_angle_deg, 11.421, 1e-3);  // 2 · atan(1/10)
  EXPECT_NEAR(points[0].error_px, 1.0 / 3, 1e-12);         // half a pixel in two frames of three
  EXPECT_EQ(points[1].sightings, 1u);                      // one frame sees it twice
  EXPECT_EQ(points[3].error_px, 0.7);                      // without a track
  const ModelQuality quality = quality_of(points);
  EXPECT_EQ(quality.points, 1u);  // the others: one frame only; an angle of 0.1 degrees
  EXPECT_NEAR(quality.reprojection_px, 1.0 / 3, 1e-12);
}

TEST(ColmapModel, WhatIsNoPointIsRefused) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "cameras.txt", std::string_view(kCameras));
  write_file_atomically(folder.path() / "images.txt", std::string_view(kImages));
  write_file_atomically(folder.path() / "points3D.txt", std::string_view("1 2 three\n"));
  EXPECT_THROW(read_model_points(folder.path()), BadDataError);
  EXPECT_THROW(read_model_points(folder.path() / "none"), NoInputError);
}

}  // namespace
}  // namespace organbake
