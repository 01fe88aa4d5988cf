// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>

#include "organbake/core/error.h"
#include "organbake/volume/volume.h"
#include "support/error_message.h"

namespace organbake {

// A value for every place in the world that no mirroring, turning or shifting maps onto itself: a
// reader that gets one axis wrong gives nearly every voxel a wrong value.
double ramp_hu(const Eigen::Vector3d& world_mm);

// A rotation about all three axes.
Eigen::Matrix3d oblique_direction();

// The ramp sampled on a grid of 5×4×3 voxels of 0.8×1.25×3 mm.
Volume ramp_volume(const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity(),
                   const Eigen::Vector3d& origin_mm = {-40, 25, 110});

// How far the voxels of a volume are from the ramp at their own places, in HU.
double largest_ramp_error(const Volume& volume);

void write_bytes(const std::filesystem::path& path, const std::string& bytes);
std::string read_bytes(const std::filesystem::path& path);
std::string gzipped(const std::string& bytes);
// The voxels as little-endian int16.
std::string voxel_bytes(const Volume& volume);

inline std::filesystem::path shared_data(const std::string& below) {
  return std::filesystem::path(ORGANBAKE_SHARED_DATA) / below;
}

// The DICOM abdomen, decoded once for all tests (JPEG 2000 takes its time).
const Volume& dicom_abdomen();

// Skips a test, loudly, where the real data is not there.
#define REQUIRE_SHARED_DATA(below)                                            \
  if (!std::filesystem::exists(::organbake::shared_data(below))) {            \
    GTEST_SKIP() << "REAL DATA MISSING: " << ::organbake::shared_data(below); \
  }

}  // namespace organbake
