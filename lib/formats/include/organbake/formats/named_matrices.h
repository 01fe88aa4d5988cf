// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"

namespace organbake {

// The matrices, numbers and words that a calibration keeps under names.
struct NamedMatrices {
  struct Matrix {
    std::vector<double> values;  // row by row
    int rows = 0, columns = 0;
  };
  std::map<std::string, Matrix> matrices;  // names in lower case, without '_' and '-'
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> words;
  std::map<std::string, NamedMatrices> parts;  // named parts that hold such things themselves
  std::map<std::string, std::string>
      faults;  // why what has this name is no matrix, whole sentences

  // The first of these names that is there. Throws BadDataError where it is, but is no matrix.
  const Matrix* find(std::initializer_list<const char*> names) const;
  std::optional<double> number(std::initializer_list<const char*> names) const;
  const NamedMatrices* part(std::initializer_list<const char*> names) const;
};

// Adds what an OpenCV file storage (YAML, JSON or XML), or an .ini of sections, holds: its
// matrices, sequences of numbers or of rows, numbers and words. What is larger than a lens's
// matrices is kept by its name alone: calibrations have the corners of their boards as well. Throws
// BadDataError, for NumPy's, MATLAB's and OCamCalib's own files with what to do.
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
inline constexpr std::initializer_list<const char*> kDistortion = {"distortioncoefficients",
                                                                   "distcoeffs",
                                                                   "d",
                                                                   "distortion",
                                                                   "distortioncoeffs",
                                                                   "distcoeff",
                                                                   "distcoef",
                                                                   "kc",
                                                                   "dist"};
inline constexpr std::initializer_list<const char*> kLeftDistortion = {
    "d1", "distcoeffs1",    "distortioncoefficients1", "distcoeffsl",
    "dl", "distcoeffsleft", "leftdistcoeffs",          "dist1",
    "kc1"};
inline constexpr std::initializer_list<const char*> kRightDistortion = {
    "d2", "distcoeffs2",     "distortioncoefficients2", "distcoeffsr",
    "dr", "distcoeffsright", "rightdistcoeffs",         "dist2",
    "kc2"};

// A text of rows of numbers. Throws BadDataError when it holds anything else, or uneven rows.
NamedMatrices::Matrix read_matrix_file(const std::filesystem::path& path);

// Throws BadDataError where the document names a distortion that none of these names is: it would
// be dropped.
void refuse_unread_distortion(const NamedMatrices& found, const std::filesystem::path& path);

// The size of the pictures that were calibrated, else the given one.
Intrinsics sized_lens(const NamedMatrices& found, int width, int height);

// Sets the focal lengths and the principal point. OpenCV counts from the first pixel's centre, we
// from its corner.
void set_opencv_pinhole(double fx, double fy, double cx, double cy, Intrinsics& lens);

}  // namespace organbake
