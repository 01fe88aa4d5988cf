// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {

// One half for rounding the ramp to whole units, a little for the text of the positions.
inline constexpr double kRounding_hu = 0.5 + 1e-3;
// Resampled values are rounded twice.
inline constexpr double kTwiceRounded_hu = 1.0 + 1e-3;

// Bytes that become a file of this name, in a folder of the test's own, and are read.
class VolumeFileTest : public ::testing::Test {
 protected:
  explicit VolumeFileTest(const char* name) : file_(folder_.path() / name) {}

  Volume read(const std::string& bytes, const VolumeReadOptions& options = {}) const {
    write_bytes(file_, bytes);
    return read_volume(file_, options);
  }
  std::string error(const std::string& bytes, const VolumeReadOptions& options = {},
                    ExitCode code = ExitCode::bad_data) const {
    return message_of(code, [&] { read(bytes, options); });
  }

  TemporaryFolder folder_;
  std::filesystem::path file_;
};

// ImageOrientationPatient.
inline std::string orientation_text(const Eigen::Matrix3d& axes) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += (i ? "\\" : "") + to_text(axes(i % 3, i / 3), 10);
  return text;
}

class DicomFolderTest : public ::testing::Test {
 protected:
  // A slice whose pixels show the ramp at their places; stored = HU + 1024.
  DicomBytes slice_at(const Eigen::Vector3d& position, const Eigen::Matrix3d& axes) const {
    DicomBytes slice;
    slice.set_position(position);
    slice.orientation = orientation_text(axes);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        const Eigen::Vector3d world =
            position + 0.75 * column * axes.col(0) + 0.5 * row * axes.col(1);
        slice.pixels.push_back(static_cast<std::uint16_t>(std::lround(ramp_hu(world) + 1024)));
      }
    }
    return slice;
  }
  void add(const std::string& name, const DicomBytes& slice) {
    write_bytes(folder_.path() / name, slice.bytes());
  }
  // Slices at the given distances along the normal; names in reverse order of place.
  void add_stack(const std::vector<double>& along, const Eigen::Matrix3d& axes,
                 const Eigen::Vector3d& drift_per_mm = Eigen::Vector3d::Zero()) {
    for (std::size_t k = 0; k < along.size(); ++k) {
      const Eigen::Vector3d position =
          Eigen::Vector3d(5, -8, 20) + along[k] * (axes.col(2) + drift_per_mm);
      add("slice" + std::to_string(along.size() - k), slice_at(position, axes));
    }
  }
  Volume read(const VolumeReadOptions& options = {}) {
    return read_volume(folder_.path(), options);
  }
  std::string error(const VolumeReadOptions& options = {}) {
    return message_of(ExitCode::bad_data, [&] { read(options); });
  }

  TemporaryFolder folder_;
};

}  // namespace organbake
