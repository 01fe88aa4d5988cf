// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "geometry/camera.h"

namespace organbake {

// The matrices, numbers and words that a calibration keeps under names.
struct NamedMatrices {
  struct Rows {
    std::vector<double> values;  // row by row
    int rows = 0, columns = 0;
  };
  std::map<std::string, Rows> matrices;  // names in lower case, without '_' and '-'
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> words;

  // The first of these names that is there.
  const Rows* find(std::initializer_list<const char*> names) const;
  std::optional<double> number(std::initializer_list<const char*> names) const;
};

// Adds what an OpenCV file storage (YAML, JSON or XML) holds: its matrices, sequences of numbers or
// of rows, numbers and words. What is larger than a lens's matrices is passed over: calibrations
// keep the corners of their boards as well. Throws BadDataError.
void add_opencv_document(const std::filesystem::path& path, NamedMatrices& found);
// The same of its text; `path` is named in errors.
void add_opencv_text(const std::string& text, const std::filesystem::path& path,
                     NamedMatrices& found);

// What programs call the left eye's.
inline constexpr std::initializer_list<const char*> kLeftCameraMatrix = {"k1",
                                                                         "m1",
                                                                         "cameramatrix1",
                                                                         "cm1",
                                                                         "cameramatrixl",
                                                                         "kl",
                                                                         "ml",
                                                                         "cameramatrixleft",
                                                                         "leftcameramatrix",
                                                                         "kleft",
                                                                         "intrinsic1"};
inline constexpr std::initializer_list<const char*> kLeftDistortion = {
    "d1", "distcoeffs1",    "distortioncoefficients1", "distcoeffsl",
    "dl", "distcoeffsleft", "leftdistcoeffs",          "dist1",
    "kc1"};

// A text of rows of numbers. Throws BadDataError when it holds anything else, or uneven rows.
NamedMatrices::Rows read_rows(const std::filesystem::path& path);

// The size of the pictures that were calibrated, else the given one.
Intrinsics sized_lens(const NamedMatrices& found, int width, int height);

// Sets the focal lengths and the principal point. OpenCV counts from the first pixel's centre, we
// from its corner.
void set_opencv_pinhole(double fx, double fy, double cx, double cy, Intrinsics& lens);

// The lens of a matrix of 3×3 and, if given, k1 k2 p1 p2 k3. Throws BadDataError where more of a
// distortion than that is not 0, or where the document's words name another model of lenses (a
// fisheye's four numbers look like k1 k2 p1 p2, and are none).
Intrinsics lens_of_matrices(const NamedMatrices& found, const NamedMatrices::Rows& k,
                            const NamedMatrices::Rows* d, Intrinsics sized,
                            const std::filesystem::path& path);

}  // namespace organbake
