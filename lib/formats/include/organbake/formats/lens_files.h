// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {

// What programs call one thing.
using Names = std::initializer_list<const char*>;

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
  const Matrix* find(Names names) const;
  std::optional<double> number(Names names) const;
  const NamedMatrices* part(Names names) const;
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
inline constexpr Names kLeftCameraMatrix = {"k1",
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
inline constexpr Names kDistortion = {"distortioncoefficients",
                                      "distcoeffs",
                                      "d",
                                      "distortion",
                                      "distortioncoeffs",
                                      "distcoeff",
                                      "distcoef",
                                      "kc",
                                      "dist"};
inline constexpr Names kLeftDistortion = {
    "d1", "distcoeffs1",    "distortioncoefficients1", "distcoeffsl",
    "dl", "distcoeffsleft", "leftdistcoeffs",          "dist1",
    "kc1"};
inline constexpr Names kRightDistortion = {
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

enum class EndoscopeEye { left, right };

// The lens of an eye in a calibration that keeps each camera as a part of its own; nothing where it
// does not:
// - Kalibr's camchain (cam0, cam1: intrinsics, distortion_coeffs, resolution),
// - StereoMIS's StereoCalibration.ini ([StereoLeft], [StereoRight]: fc_x, cc_x, kc_0 …),
// - MATLAB's cameraParameters and stereoParameters as jsonencode(toStruct(…)) writes them, whose
//   pixels are counted from 1.
// `width` and `height` are the pictures', for a document that does not tell them. Throws
// BadDataError.
std::optional<Intrinsics> lens_of_parts(const NamedMatrices& found, EndoscopeEye eye, int width,
                                        int height, const std::filesystem::path& path);

// How the right eye stands to the left one, in the document's unit, and how many millimetres that
// is where its program knows one alone (Kalibr: metres). Nothing where the parts do not tell.
struct PoseOfParts {
  RigidTransform right_from_left;
  std::optional<double> mm_per_unit;
};
std::optional<PoseOfParts> pose_of_parts(const NamedMatrices& found,
                                         const std::filesystem::path& path);

// The part that holds the matrices themselves: SCARED's frame_data.json has them under
// "camera-calibration"; else the whole.
const NamedMatrices& matrices_of(const NamedMatrices& found);

// The lens of a matrix of 3×3 and, if given, k1 k2 p1 p2 k3, or k1 k2 k3 k4 where the document's
// words name a fisheye's model (equidistant, Kannala–Brandt). Throws BadDataError for another
// model, where more of a distortion than that is not 0, for a count of numbers that no distortion
// has, for one that is no number, and for a matrix of another form.
Intrinsics lens_of_matrices(const NamedMatrices& found, const NamedMatrices::Matrix& k,
                            const NamedMatrices::Matrix* d, Intrinsics sized,
                            const std::filesystem::path& path);

// Throws BadDataError, naming `path`, where a lens cannot be that of pictures of this size: it is
// of another, its focal length is no lens's (shares of the sides, another size), or its axis meets
// the picture far off the middle in both directions, or beside it (a halved or doubled
// calibration). `whose` names the camera among several: "left"; "" = there is one.
void check_lens_of_picture(const Intrinsics& lens, int width, int height,
                           const std::filesystem::path& path, const std::string& whose = "");

}  // namespace organbake
