// SPDX-License-Identifier: GPL-3.0-or-later
// Both pictures of a stereo rig turned so that a point lies in the same row of each
// (cv::stereoRectify; Bouguet's method), since matching looks along rows.
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "organbake/core/error.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {
namespace {

constexpr double kHalfPixel = 0.5;  // OpenCV counts from the first pixel's centre

cv::Mat pinhole_matrix(const Intrinsics& k) {
  return (cv::Mat_<double>(3, 3) << k.fx, 0, k.cx - kHalfPixel, 0, k.fy, k.cy - kHalfPixel, 0, 0,
          1);
}

cv::Mat distortion(const Intrinsics& k) {
  if (k.model == LensModel::fisheye) return (cv::Mat_<double>(1, 4) << k.k1, k.k2, k.k3, k.k4);
  return (cv::Mat_<double>(1, 5) << k.k1, k.k2, k.p1, k.p2, k.k3);
}

// What rectification starts from: a fisheye as the pinhole that its picture is straightened to.
Intrinsics before_turning(const Intrinsics& lens) {
  return lens.model == LensModel::fisheye ? pinhole_of(lens) : lens;
}

void rectifying_map(const Intrinsics& lens, const cv::Mat& turn, const cv::Mat& projection,
                    cv::Mat& columns, cv::Mat& rows) {
  const cv::Size size(lens.width, lens.height);
  if (lens.model == LensModel::fisheye) {
    cv::fisheye::initUndistortRectifyMap(pinhole_matrix(lens), distortion(lens), turn, projection,
                                         size, CV_16SC2, columns, rows);
  } else {
    cv::initUndistortRectifyMap(pinhole_matrix(lens), distortion(lens), turn, projection, size,
                                CV_16SC2, columns, rows);
  }
}

// Rows are the same rows to a hundredth of a pixel anywhere in the picture.
bool is_rectified(const StereoRig& rig) {
  constexpr double kRowsApart_px = 0.01;
  const Intrinsics &a = rig.left, &b = rig.right;
  if (a.has_distortion() || b.has_distortion()) return false;
  const double side = a.width + a.height;
  const Eigen::Vector3d& t = rig.right_from_left.translation;
  const double turned =
      (rig.right_from_left.rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double askew = std::hypot(t.y(), t.z()) / t.norm();
  const double unlike =
      std::abs(a.fx / b.fx - 1) + std::abs(a.fy / b.fy - 1) + std::abs(a.cy - b.cy) / side;
  return (turned + askew + unlike) * side < kRowsApart_px;
}

}  // namespace

PosedCamera RectifiedEyes::right() const {
  PosedCamera right{"right", camera, {}};
  right.intrinsics.cx -= disparity_at_infinity;
  right.camera_from_world.translation.x() = -baseline_mm;
  return right;
}

struct Rectifier::Impl {
  RectifiedEyes eyes;
  cv::Mat columns[2], rows[2];  // of the left and the right picture; empty when nothing changes

  void rectify(const StereoRig& rig) {
    cv::Mat r, t, r1, r2, p1, p2, q;
    cv::eigen2cv(rig.right_from_left.rotation, r);
    cv::eigen2cv(rig.right_from_left.translation, t);
    const cv::Size size(rig.left.width, rig.left.height);
    constexpr double kOpenCvsOwnScale = -1;
    const Intrinsics left = before_turning(rig.left), right = before_turning(rig.right);
    cv::stereoRectify(pinhole_matrix(left), distortion(left), pinhole_matrix(right),
                      distortion(right), size, r, t, r1, r2, p1, p2, q, /*flags=*/0,
                      kOpenCvsOwnScale, size);
    if (p2.at<double>(1, 3) != 0 || !(p2.at<double>(0, 3) < 0) || !(p1.at<double>(0, 0) > 0))
      throw BadDataError("the eyes of the calibration cannot be brought side by side");
    eyes.camera = pinhole_of(rig.left);
    eyes.camera.fx = p1.at<double>(0, 0);
    eyes.camera.fy = p1.at<double>(1, 1);
    eyes.camera.cx = p1.at<double>(0, 2) + kHalfPixel;
    eyes.camera.cy = p1.at<double>(1, 2) + kHalfPixel;
    eyes.disparity_at_infinity = p1.at<double>(0, 2) - p2.at<double>(0, 2);
    cv::cv2eigen(r1, eyes.rectified_from_left.rotation);
    rectifying_map(rig.left, r1, p1, columns[0], rows[0]);
    rectifying_map(rig.right, r2, p2, columns[1], rows[1]);
  }

  StoredPicture turned(StoredPicture picture, int eye) const {
    picture.linear.clear();
    if (columns[eye].empty()) return picture;
    StoredPicture result(Rgb8Image(picture.color.width, picture.color.height));
    const cv::Mat from(picture.color.height, picture.color.width, CV_8UC3,
                       picture.color.pixels.data());
    cv::Mat to(from.rows, from.cols, CV_8UC3, result.color.pixels.data());
    cv::remap(from, to, columns[eye], rows[eye], cv::INTER_CUBIC, cv::BORDER_CONSTANT);
    return result;
  }
};

Rectifier::Rectifier(const StereoRig& rig) : impl_(new Impl) {
  impl_->eyes.camera = rig.left;
  impl_->eyes.baseline_mm = rig.baseline_mm();
  impl_->eyes.disparity_at_infinity = rig.left.cx - rig.right.cx;
  if (!is_rectified(rig)) impl_->rectify(rig);
}
Rectifier::~Rectifier() = default;
Rectifier::Rectifier(Rectifier&&) noexcept = default;

const RectifiedEyes& Rectifier::eyes() const { return impl_->eyes; }
bool Rectifier::changes_pictures() const { return !impl_->columns[0].empty(); }
StoredPicture Rectifier::left(StoredPicture picture) const {
  return impl_->turned(std::move(picture), 0);
}
StoredPicture Rectifier::right(StoredPicture picture) const {
  return impl_->turned(std::move(picture), 1);
}

}  // namespace organbake
