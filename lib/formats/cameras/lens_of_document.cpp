// SPDX-License-Identifier: GPL-3.0-or-later
// The lens of one eye, of the calibrations that surgical and robotic programs write (Kalibr,
// MATLAB, ROS, SCARED and others, listed in lens_files.h): from the words and matrices of a
// document to focal lengths, centre and distortion in our conventions, with one check for all. What
// is of another program and not read is refused by name.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "cameras/camera_formats.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/formats/lens_files.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Matrix = NamedMatrices::Matrix;

const Matrix& needed(const Matrix* rows, std::size_t count, const char* name,
                     const fs::path& path) {
  if (rows && rows->values.size() == count) return *rows;
  throw BadDataError(path, std::string("needs ") + std::to_string(count) + " numbers under '" +
                               name + "' of each camera");
}

double needed(std::optional<double> number, const std::string& name, const fs::path& path) {
  if (number) return *number;
  throw BadDataError(path, "needs a number '" + name + "' of each camera");
}

Matrix camera_matrix(double fx, double fy, double cx, double cy) {
  return {{fx, 0, cx, 0, fy, cy, 0, 0, 1}, 3, 3};
}

RigidTransform pose_of(const Eigen::Matrix3d& written, const Eigen::Vector3d& translation,
                       const fs::path& path) {
  const auto rotation = written_rotation(written);
  if (!rotation || !translation.allFinite())
    throw BadDataError(path, "holds no proper rotation between its eyes");
  return {*rotation, translation};
}

Eigen::Matrix3d matrix3(const std::vector<double>& v, std::size_t stride) {
  Eigen::Matrix3d m;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      m(Eigen::Index(row), Eigen::Index(column)) = v[row * stride + column];
  return m;
}

// Kalibr ------------------------------------------------------------------------------------------

const NamedMatrices* kalibr_camera(const NamedMatrices& found, EndoscopeEye eye) {
  const NamedMatrices* camera = found.part({eye == EndoscopeEye::left ? "cam0" : "cam1"});
  return camera &&
                 (camera->matrices.contains("intrinsics") || camera->faults.contains("intrinsics"))
             ? camera
             : nullptr;
}

Intrinsics kalibr_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const Matrix& k = needed(camera.find({"intrinsics"}), 4, "intrinsics", path);
  const auto& v = k.values;
  return lens_of_matrices(camera, camera_matrix(v[0], v[1], v[2], v[3]),
                          camera.find({"distortioncoeffs"}), sized_lens(camera, width, height),
                          path);
}

// StereoMIS ---------------------------------------------------------------------------------------

const NamedMatrices* ini_camera(const NamedMatrices& found, EndoscopeEye eye) {
  return found.part({eye == EndoscopeEye::left ? "stereoleft" : "stereoright"});
}

Intrinsics ini_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const auto number = [&](const char* name) { return needed(camera.number({name}), name, path); };
  Intrinsics sized;
  sized.width = camera.number({"resx"}) ? written_size(number("resx")) : width;
  sized.height = camera.number({"resy"}) ? written_size(number("resy")) : height;
  Matrix d{{}, 1, 0};
  for (std::string name = "kc0"; camera.words.contains(name);
       name = "kc" + std::to_string(d.values.size()))
    d.values.push_back(number(name.c_str()));
  d.columns = static_cast<int>(d.values.size());
  return lens_of_matrices(camera,
                          camera_matrix(number("fcx"), number("fcy"), number("ccx"), number("ccy")),
                          d.values.empty() ? nullptr : &d, sized, path);
}

RigidTransform ini_pose(const NamedMatrices& right, const fs::path& path) {
  std::vector<double> r, t;
  for (int i = 0; i < 9; ++i)
    r.push_back(needed(right.number({("r" + std::to_string(i)).c_str()}), "R_0 … R_8", path));
  for (int i = 0; i < 3; ++i)
    t.push_back(needed(right.number({("t" + std::to_string(i)).c_str()}), "T_0 … T_2", path));
  return pose_of(matrix3(r, 3), {t[0], t[1], t[2]}, path);
}

// MATLAB ------------------------------------------------------------------------------------------

bool is_matlab(const NamedMatrices& camera) {
  return camera.matrices.contains("radialdistortion") || camera.faults.contains("radialdistortion");
}

const NamedMatrices* matlab_camera(const NamedMatrices& found, EndoscopeEye eye) {
  if (const NamedMatrices* camera =
          found.part({eye == EndoscopeEye::left ? "cameraparameters1" : "cameraparameters2"}))
    return is_matlab(*camera) ? camera : nullptr;
  if (const NamedMatrices* inner = found.part({"intrinsics"}); inner && is_matlab(*inner))
    return inner;
  return is_matlab(found) ? &found : nullptr;
}

// Its older IntrinsicMatrix is transposed.
Matrix matlab_matrix(const NamedMatrices& camera, const fs::path& path) {
  const Matrix* focal = camera.find({"focallength"});
  const Matrix* centre = camera.find({"principalpoint"});
  if (focal && centre)
    return camera_matrix(needed(focal, 2, "FocalLength", path).values[0], focal->values[1],
                         needed(centre, 2, "PrincipalPoint", path).values[0], centre->values[1]);
  if (const Matrix* k = camera.find({"k"})) return needed(k, 9, "K", path);
  const auto& m = needed(camera.find({"intrinsicmatrix"}), 9, "IntrinsicMatrix", path).values;
  return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}, 3, 3};
}

Intrinsics matlab_lens(const NamedMatrices& camera, int width, int height, const fs::path& path) {
  const Matrix* radial = camera.find({"radialdistortion"});
  if (!radial || radial->values.size() < 2 || radial->values.size() > 3)
    throw BadDataError(path, "needs two or three numbers under 'RadialDistortion'");
  const Matrix* tangential = camera.find({"tangentialdistortion"});
  std::vector<double> d = {radial->values[0], radial->values[1], 0, 0,
                           radial->values.size() == 3 ? radial->values[2] : 0};
  if (tangential) {
    d[2] = needed(tangential, 2, "TangentialDistortion", path).values[0];
    d[3] = tangential->values[1];
  }
  Intrinsics sized;
  sized.width = width;
  sized.height = height;
  if (const Matrix* size = camera.find({"imagesize"})) {
    sized.height = written_size(needed(size, 2, "ImageSize", path).values[0]);
    sized.width = written_size(size->values[1]);
  }
  const Matrix distortion{std::move(d), 1, 5};
  Intrinsics lens = lens_of_matrices(camera, matlab_matrix(camera, path), &distortion, sized, path);
  lens.cx -= 1;  // its first pixel's centre is (1, 1)
  lens.cy -= 1;
  return lens;
}

// Row vectors: x_right = x_left R + t.
std::optional<RigidTransform> matlab_pose(const NamedMatrices& found, const fs::path& path) {
  if (const NamedMatrices* pose = found.part({"posecamera2"})) {
    const auto& r = needed(pose->find({"r"}), 9, "PoseCamera2.R", path).values;
    const auto& t = needed(pose->find({"translation"}), 3, "PoseCamera2.Translation", path).values;
    return pose_of(matrix3(r, 3), {t[0], t[1], t[2]}, path);
  }
  const Matrix* rotation = found.find({"rotationofcamera2"});
  if (!rotation) return std::nullopt;
  const auto& t =
      needed(found.find({"translationofcamera2"}), 3, "TranslationOfCamera2", path).values;
  return pose_of(matrix3(needed(rotation, 9, "RotationOfCamera2", path).values, 3).transpose(),
                 {t[0], t[1], t[2]}, path);
}

// ROS names the model of a distortion, Kalibr and others that of the whole lens, and OpenCV's own
// calibration program says whether it is a fisheye.
LensModel model_of(const NamedMatrices& found, const fs::path& path) {
  const auto word = [&](const char* name) {
    const auto at = found.words.find(name);
    return at == found.words.end() ? std::string() : plain_name(at->second);
  };
  const auto is_fisheye = [](const std::string& name) {
    return is_any_of(name, {"equidistant", "equi", "fisheye", "kannalabrandt", "kannalabrandt4",
                            "kb4", "opencvfisheye"});
  };
  const std::string distortion = word("distortionmodel"), lens = word("cameramodel");
  if (is_fisheye(distortion) || is_fisheye(lens) ||
      found.number({"fisheyemodel", "isfisheye"}).value_or(0) != 0)
    return LensModel::fisheye;
  std::string other;
  if (!is_any_of(distortion, {"", "plumbbob", "rationalpolynomial", "radtan", "radialtangential",
                              "brown", "brownconrady", "opencv", "none"}))
    other = distortion;
  for (const char* wide : {"fisheye", "equidistant", "omni", "ocam", "kannala", "scaramuzza",
                           "eucm", "doublesphere", "ds"})
    if (lens == wide || (lens.find(wide) != lens.npos && std::strlen(wide) > 3)) other = lens;
  if (!other.empty())
    throw BadDataError(path, "is of the lens model \"" + other +
                                 "\", which is not supported; calibrate it as a pinhole with k1 k2 "
                                 "p1 p2 k3, or as OpenCV's fisheye with k1 k2 k3 k4");
  return LensModel::brown;
}

void check_distortion(const NamedMatrices::Matrix& d, const fs::path& path) {
  for (const double value : d.values)
    if (!std::isfinite(value))
      throw BadDataError(path, "its distortion holds a number that is not finite");
}

void set_fisheye(const NamedMatrices::Matrix& d, Intrinsics& lens, const fs::path& path) {
  lens.model = LensModel::fisheye;
  if (d.values.size() != 4)
    throw BadDataError(path, "its distortion has " + std::to_string(d.values.size()) +
                                 " numbers; a fisheye's has four: k1 k2 k3 k4");
  lens.k1 = d.values[0];
  lens.k2 = d.values[1];
  lens.k3 = d.values[2];
  lens.k4 = d.values[3];
}

// OpenCV's order: k1 k2 p1 p2, k3, k4 k5 k6, s1…s4, τx τy.
void set_brown(const NamedMatrices::Matrix& d, Intrinsics& lens, const fs::path& path) {
  const std::size_t count = d.values.size();
  const bool none = std::all_of(d.values.begin(), d.values.end(), [](double v) { return v == 0; });
  if (none) return;
  if (count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
    throw BadDataError(path, "its distortion has " + std::to_string(count) +
                                 " numbers; OpenCV's have 4, 5, 8, 12 or 14: k1 k2 p1 p2 (k3 …)");
  double* const target[] = {&lens.k1, &lens.k2, &lens.p1, &lens.p2, &lens.k3};
  for (std::size_t i = 0; i < count; ++i) {
    if (i < std::size(target)) *target[i] = d.values[i];
    if (i >= std::size(target) && d.values[i] != 0)
      throw BadDataError(
          path,
          "only k1 k2 p1 p2 k3 of a distortion are supported, no rational model with "
          "k4 k5 k6, thin prism or tilt; calibrate it without them");
  }
}

// [fx s cx; 0 fy cy; 0 0 1].
void check_camera_matrix(const NamedMatrices::Matrix& k, const fs::path& path) {
  if (k.values.size() != 9) throw BadDataError(path, "a camera matrix must be 3x3");
  const std::vector<double>& m = k.values;
  constexpr double kNoSkew = 1e-3;  // of the focal length: no pixel of a picture shows it
  if (m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
    throw BadDataError(path,
                       "its camera matrix is not of the form fx 0 cx, 0 fy cy, 0 0 1 (is it "
                       "transposed?)");
  if (!(std::abs(m[1]) <= kNoSkew * std::abs(m[0])))
    throw BadDataError(path, "its camera matrix has a skew of " + to_text(m[1]) +
                                 ", which is not supported; calibrate it without one");
}

constexpr const char* kInPython =
    "; write its matrices as OpenCV does: fs = cv2.FileStorage('lens.yml', "
    "cv2.FILE_STORAGE_WRITE), fs.write('camera_matrix', K), fs.write('distortion_coefficients', D)";
constexpr const char* kInMatlab =
    "; write its parameters as JSON: writelines(jsonencode(toStruct(params)), 'lens.json')";

void add_value(const std::string& key, const std::string& value, NamedMatrices& section) {
  const std::string name = plain_name(key);
  section.words[name] = value;
  if (const auto number = number_in<double>(value)) section.numbers[name] = *number;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

Intrinsics lens_of_matrices(const NamedMatrices& found, const NamedMatrices::Matrix& k,
                            const NamedMatrices::Matrix* d, Intrinsics lens, const fs::path& path) {
  const LensModel model = model_of(found, path);
  check_camera_matrix(k, path);
  set_opencv_pinhole(k.values[0], k.values[4], k.values[2], k.values[5], lens);
  if (!d) {
    refuse_unread_distortion(found, path);
    if (model == LensModel::fisheye)
      throw BadDataError(path, "is of a fisheye, but lacks its k1 k2 k3 k4");
    return lens;
  }
  check_distortion(*d, path);
  model == LensModel::fisheye ? set_fisheye(*d, lens, path) : set_brown(*d, lens, path);
  return lens;
}

std::optional<Intrinsics> lens_of_parts(const NamedMatrices& found, EndoscopeEye eye, int width,
                                        int height, const fs::path& path) {
  if (const NamedMatrices* camera = kalibr_camera(found, eye))
    return kalibr_lens(*camera, width, height, path);
  if (const NamedMatrices* camera = ini_camera(found, eye))
    return ini_lens(*camera, width, height, path);
  if (const NamedMatrices* camera = matlab_camera(found, eye))
    return matlab_lens(*camera, width, height, path);
  return std::nullopt;
}

std::optional<PoseOfParts> pose_of_parts(const NamedMatrices& found, const fs::path& path) {
  if (const NamedMatrices* right = kalibr_camera(found, EndoscopeEye::right)) {
    constexpr double kMetre_mm = 1000;
    const auto& v = needed(right->find({"tcncnm1"}), 16, "T_cn_cnm1", path).values;
    return PoseOfParts{pose_of(matrix3(v, 4), {v[3], v[7], v[11]}, path), kMetre_mm};
  }
  if (const NamedMatrices* right = ini_camera(found, EndoscopeEye::right))
    return PoseOfParts{ini_pose(*right, path), std::nullopt};
  if (const auto pose = matlab_pose(found, path)) return PoseOfParts{*pose, std::nullopt};
  return std::nullopt;
}

const NamedMatrices& matrices_of(const NamedMatrices& found) {
  const NamedMatrices* inside = found.part({"cameracalibration"});
  return inside ? *inside : found;
}

void refuse_foreign_calibration(const std::string& bytes, const fs::path& path) {
  const auto begins = [&](const char* with) { return bytes.starts_with(with); };
  if (begins("PK\x03\x04"))
    throw BadDataError(path,
                       std::string("is a NumPy archive (.npz) or another ZIP file") + kInPython);
  if (begins("\x93NUMPY"))
    throw BadDataError(path, std::string("is a NumPy array (.npy)") + kInPython);
  if (begins("\x80")) throw BadDataError(path, std::string("is a Python pickle") + kInPython);
  if (begins("MATLAB ") || begins("\x89HDF"))
    throw BadDataError(path, std::string("is a MATLAB file (.mat)") + kInMatlab);
  if (bytes.find("ocam_model") != bytes.npos ||
      bytes.find("polynomial coefficients for the DIRECT mapping") != bytes.npos)
    throw BadDataError(path,
                       "is of OCamCalib, whose polynomial of a lens is not read; calibrate it as "
                       "OpenCV's fisheye (k1 k2 k3 k4)");
  if (bytes.find('\0') != bytes.npos)
    throw BadDataError(path, "is no text; a calibration is YAML, JSON, XML or an .ini");
}

void add_ini(const std::string& text, const fs::path& path, NamedMatrices& found) {
  std::istringstream lines(text);
  NamedMatrices* section = &found;
  for (std::string line; std::getline(lines, line);) {
    line = trimmed(line);
    if (line.empty() || line.front() == ';' || line.front() == '#') continue;
    const std::size_t equals = line.find('=');
    if (line.front() == '[' && line.back() == ']') {
      section = &found.parts[plain_name(line.substr(1, line.size() - 2))];
    } else if (equals != line.npos) {
      add_value(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)), *section);
    } else {
      throw BadDataError(path, "its line '" + line.substr(0, 40) +
                                   "' is neither a [section] nor of the form key = value");
    }
  }
}

void check_lens_of_picture(const Intrinsics& lens, int width, int height,
                           const std::filesystem::path& path, const std::string& whose) {
  const std::string picture =
      (whose.empty() ? "the picture is " : "the " + whose + " one is ") + size_text(width, height);
  const std::string eye = whose.empty() ? "a" : "the " + whose + " eye's";
  if (lens.width != width || lens.height != height)
    throw BadDataError(path, "is of pictures of " + size_text(lens.width, lens.height) + ", " +
                                 picture + "; give the calibration of this size");
  // In widths of the picture: from 170° across to 3°.
  constexpr double kShortest = 0.04, kLongest = 20;
  for (const double focal : {lens.fx / width, lens.fy / height})
    if (!(focal >= kShortest && focal <= kLongest))
      throw BadDataError(path, "has " + eye + " focal length of " + to_text(lens.fx, 2) + ", " +
                                   to_text(lens.fy, 2) + " px, and " + picture +
                                   ": is it in shares of the sides, or of another size?");
  constexpr double kBothOffMiddle = 0.22, kOneOffMiddle = 0.4;
  const double x = std::abs(lens.cx / width - 0.5), y = std::abs(lens.cy / height - 0.5);
  if (!(std::min(x, y) <= kBothOffMiddle && std::max(x, y) <= kOneOffMiddle))
    throw BadDataError(path, "has " + eye + " principal point at " + to_text(lens.cx, 1) + ", " +
                                 to_text(lens.cy, 1) + ", far off the middle of a picture of " +
                                 size_text(width, height) + ": is it of another size?");
  lens.check();
}

}  // namespace organbake
