// SPDX-License-Identifier: GPL-3.0-or-later
//
// One camera tells no lengths: all it sees could be twice as large and twice as far away. A length
// that is known fixes that one factor. Two places of the tissue have their distance in the scene.
// An instrument moves by itself, so that parallax says nothing of it; but its outlines do: both are
// tangent planes of a cylinder that pass through the lens, and the cylinder's axis lies at radius /
// sin(half their angle) in the plane between them.
#include "organbake/motion/key_depths.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

KnownScale middle_of(const std::vector<double>& scales, double own_sd) {
  const double usual = median(scales);
  std::vector<double> off;
  for (const double scale : scales) off.push_back(std::abs(scale / usual - 1));
  return {usual, std::hypot(kSigmaOfMedianDeviation * median(std::move(off)), own_sd),
          scales.size()};
}

// Planar depth of what a key frame has in the direction of `ray` (z = 1) of another camera, in that
// camera's axes; the nearest where one hides another.
std::optional<double> depth_along(const Vector3d& ray, const RigidTransform& camera_from_world,
                                  const KeyDepth& key) {
  const Intrinsics& lens = key.prepared.camera;
  const RigidTransform there_from_key = camera_from_world * key.camera_from_world.inverse();
  const double reach = 1.5 / lens.fx;  // pixels beside the ray
  constexpr double kOneSurface = 1.03;
  double nearest = 0, sum = 0;
  int count = 0;
  const Plane& depth = key.depth.depth;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const float z = depth.at(x, y);
      if (!std::isfinite(z)) continue;
      const Vector3d point = there_from_key * Vector3d(unproject(lens, {x + 0.5, y + 0.5}) * z);
      if (!(point.z() > 0) || (point / point.z() - ray).norm() > reach) continue;
      if (count > 0 && point.z() > kOneSurface * nearest) continue;
      if (count == 0 || kOneSurface * point.z() < nearest) nearest = point.z(), sum = count = 0;
      sum += point.z();
      ++count;
    }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

// What lies on a straight line of a picture: normal · pixel = offset.
struct Line {
  Vector2d normal = Vector2d::UnitX();
  double offset = 0;
};

// Robust least squares (Huber): a jaw or a glint lies off the line.
std::optional<Line> line_through(const std::vector<cv::Point2f>& points) {
  constexpr std::size_t kFewest = 12;
  if (points.size() < kFewest) return std::nullopt;
  cv::Vec4f line;  // direction, and a point on it
  cv::fitLine(points, line, cv::DIST_HUBER, 0, 0.01, 0.01);
  const Vector2d normal(-line[1], line[0]);
  return Line{normal, normal.dot(Vector2d(line[2], line[3]))};
}

// The instrument of a picture: where it lies, and its two outlines.
class ShaftPicture {
 public:
  explicit ShaftPicture(const KeyDepth& key)
      : mask_(largest_region(key.prepared.instruments)), grey_(grey_levels(key.prepared.color)) {}

  // False where there is none, or nothing straight.
  bool find(const Mask& field) {
    if (!find_axis(field)) return false;
    constexpr double kFromTip = 0.3, kToRim = 0.9;  // of the length: a jaw is no shaft
    std::array<std::vector<cv::Point2f>, 2> edges;
    for (double along = kFromTip * length_; along < kToRim * length_; along += 1)
      for (const int side : {0, 1})
        if (const auto edge = edge_at(along, side)) edges[side].emplace_back(edge->x(), edge->y());
    for (const int side : {0, 1}) {
      const auto line = line_through(edges[side]);
      if (!line) return false;
      outline_[side] = *line;
    }
    return true;
  }

  const Line& outline(int side) const { return outline_[side]; }
  const Vector2d& tip() const { return tip_; }
  double half_width_px() const { return half_width_; }
  const Mask& mask() const { return mask_; }

 private:
  bool find_axis(const Mask& field) {
    std::vector<cv::Point> pixels;
    cv::findNonZero(cv_view(mask_), pixels);
    constexpr double kLeast = 0.004;  // of the picture
    if (double(pixels.size()) < kLeast * double(mask_.size())) return false;
    cv::Mat points;
    cv::Mat(pixels).reshape(1).convertTo(points, CV_64F);
    const cv::PCA axes(points, cv::noArray(), cv::PCA::DATA_AS_ROW);
    constexpr double kLong = 2;  // times as long as wide
    if (axes.eigenvalues.at<double>(0) < kLong * kLong * axes.eigenvalues.at<double>(1))
      return false;
    const Vector2d middle(axes.mean.at<double>(0) + 0.5, axes.mean.at<double>(1) + 0.5);
    axis_ = {axes.eigenvectors.at<double>(0, 0), axes.eigenvectors.at<double>(0, 1)};
    half_width_ = std::sqrt(3 * axes.eigenvalues.at<double>(1));
    double before = 0, behind = 0;
    for (const cv::Point& pixel : pixels) {
      const double along = axis_.dot(Vector2d(pixel.x + 0.5, pixel.y + 0.5) - middle);
      before = std::max(before, along);
      behind = std::max(behind, -along);
    }
    // It comes in at the rim: what lies farther inside is its tip.
    const Vector2d a = middle + before * axis_, b = middle - behind * axis_;
    const bool a_is_tip = inside_by(field, a) > inside_by(field, b);
    tip_ = a_is_tip ? a : b;
    length_ = (a - b).norm();
    if (a_is_tip) axis_ = -axis_;  // from the tip to the rim
    return true;
  }

  // Pixels to the nearest edge of the field or of the picture.
  static double inside_by(const Mask& field, const Vector2d& at) {
    cv::Mat framed, inside;
    cv::copyMakeBorder(cv_view(field), framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
    cv::distanceTransform(framed, inside, cv::DIST_L2, cv::DIST_MASK_5);
    return inside.at<float>(std::clamp(int(at.y()) + 1, 0, inside.rows - 1),
                            std::clamp(int(at.x()) + 1, 0, inside.cols - 1));
  }

  // The steepest step of brightness round the mask's border, to a part of a pixel.
  std::optional<Vector2d> edge_at(double along, int side) const {
    const Vector2d across = (side == 0 ? 1 : -1) * Vector2d(-axis_.y(), axis_.x());
    const Vector2d from = tip_ + along * axis_;
    const int last = static_cast<int>(2 * half_width_) + 6;
    const Vector2d farthest = from + (last + 1) * across;
    if (!(farthest.x() >= 1 && farthest.y() >= 1 && farthest.x() < grey_.width - 1 &&
          farthest.y() < grey_.height - 1))
      return std::nullopt;
    std::vector<double> steps;
    for (int i = last / 4; i <= last; ++i)
      steps.push_back(
          std::abs(level_at(from + (i + 1) * across) - level_at(from + (i - 1) * across)));
    const auto best = std::max_element(steps.begin(), steps.end());
    constexpr double kLeastStep = 12;
    if (best == steps.begin() || best + 1 == steps.end() || *best < kLeastStep) return std::nullopt;
    const double bend = best[-1] - 2 * best[0] + best[1];
    const double part = bend < 0 ? 0.5 * (best[-1] - best[1]) / bend : 0;
    return from + (last / 4 + double(best - steps.begin()) + part) * across;
  }

  // Between the four pixels round it.
  double level_at(const Vector2d& at) const {
    cv::Mat level;
    cv::getRectSubPix(cv_view(grey_), {1, 1}, cv::Point2f(float(at.x() - 0.5), float(at.y() - 0.5)),
                      level);
    return level.at<float>(0);
  }

  Mask mask_;
  Plane grey_;
  Vector2d axis_ = Vector2d::UnitX(), tip_ = Vector2d::Zero();
  double half_width_ = 0, length_ = 0;
  std::array<Line, 2> outline_;
};

// Planar depth of the shaft's axis at its tip, mm.
std::optional<double> tip_depth_mm(const ShaftPicture& shaft, const Intrinsics& lens,
                                   double diameter_mm) {
  const auto plane_of = [&](const Line& line) {
    // normal · (f x + c) = offset, as a plane through the lens.
    return Vector3d(line.normal.x() * lens.fx, line.normal.y() * lens.fy,
                    line.normal.x() * lens.cx + line.normal.y() * lens.cy - line.offset)
        .normalized();
  };
  const Vector3d tip = unproject(lens, shaft.tip());
  Vector3d a = plane_of(shaft.outline(0)), b = plane_of(shaft.outline(1));
  // Both away from the shaft.
  if (a.dot(tip) > 0) a = -a;
  if (b.dot(tip) > 0) b = -b;
  const Vector3d along = a.cross(b);
  const double sine = std::sqrt(std::max(0.0, (1 + a.dot(b)) / 2));  // of half their angle
  constexpr double kThinnest = 0.005;
  if (along.norm() < kThinnest || sine < kThinnest / 2) return std::nullopt;
  const Vector3d axis = along.normalized();
  const Vector3d towards = -(a + b).normalized();
  const Vector3d foot = towards * (diameter_mm / 2 / sine);
  // Where the axis passes the tip's ray.
  const Vector3d ray = tip.normalized();
  const double c = axis.dot(ray), d = axis.dot(foot), e = ray.dot(foot);
  if (1 - c * c < 1e-6) return std::nullopt;
  const double along_axis = (c * e - d) / (1 - c * c);
  const double z = (foot + along_axis * axis).z();
  return z > 0 ? std::optional(z) : std::nullopt;
}

// Depth of the tissue beside the tip, in units.
std::optional<double> tissue_depth(const ShaftPicture& shaft, const KeyDepth& key) {
  const double reach = 3 * shaft.half_width_px();
  std::vector<float> depths;
  const Plane& depth = key.depth.depth;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x)
      if (!shaft.mask().at(x, y) && std::isfinite(depth.at(x, y)) &&
          (Vector2d(x + 0.5, y + 0.5) - shaft.tip()).norm() <= reach)
        depths.push_back(depth.at(x, y));
  constexpr std::size_t kFewest = 20;
  if (depths.size() < kFewest) return std::nullopt;
  return median(std::move(depths));
}

}  // namespace

KnownDistance parse_known_distance(const std::string& text) {
  std::vector<double> numbers;
  std::string_view rest = text;
  while (!rest.empty()) {
    double number = 0;
    const std::size_t length = read_number(rest, number);
    if (length == 0 || (length < rest.size() && rest[length] != ',')) break;
    numbers.push_back(number);
    rest.remove_prefix(std::min(rest.size(), length + 1));
  }
  const bool whole = numbers.size() == 6 && rest.empty() && numbers[0] >= 0 && numbers[0] < 1e9 &&
                     numbers[0] == std::floor(numbers[0]);
  if (whole && numbers[1] == numbers[3] && numbers[2] == numbers[4])
    throw UsageError("known_distance is '" + text + "': its two pixels are the same");
  if (!whole || !(numbers[5] > 0))
    throw UsageError("known_distance is '" + text +
                     "'; write FRAME,X1,Y1,X2,Y2,MM: a frame's number from 0, two pixels of it, "
                     "and the millimetres between what they show");
  return {static_cast<std::size_t>(numbers[0]),
          {numbers[1], numbers[2]},
          {numbers[3], numbers[4]},
          numbers[5]};
}

KnownScale scale_by_distance(const KnownDistance& known, const ClipMotion& motion,
                             const std::vector<KeyDepth>& keys) {
  const std::string frame = "known_distance: frame " + std::to_string(known.frame);
  const Intrinsics& lens = motion.scene.lens;
  for (const Vector2d& pixel : {known.first, known.second})
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= lens.width && pixel.y() <= lens.height))
      throw UsageError(frame + " has no pixel " + to_text(pixel.x()) + "," + to_text(pixel.y()) +
                       "; it is " + std::to_string(lens.width) + "x" + std::to_string(lens.height));
  if (known.frame >= motion.camera_from_world.size() || !motion.camera_from_world[known.frame])
    throw UsageError(frame + " has no pose; take one of those in cameras.json");
  const RigidTransform& pose = *motion.camera_from_world[known.frame];
  const Vector3d first = unproject(lens, known.first), second = unproject(lens, known.second);
  std::vector<double> scales;
  for (const KeyDepth& key : keys) {
    const auto a = depth_along(first, pose, key), b = depth_along(second, pose, key);
    if (!a || !b) continue;
    const double apart = (*a * first - *b * second).norm();
    if (apart > 0) scales.push_back(known.distance_mm / apart);
  }
  if (scales.empty())
    throw BadDataError(frame + ": no key frame has depth at both pixels; take two others");
  const double pointing = std::sqrt(2.0) / std::max(1.0, (known.first - known.second).norm());
  return middle_of(scales, pointing);
}

KnownScale scale_by_shaft(double diameter_mm, const std::vector<KeyDepth>& keys) {
  std::vector<std::pair<double, double>> found;  // scale, relative error of the width
  for (const KeyDepth& key : keys) {
    ShaftPicture shaft(key);
    if (!shaft.find(key.prepared.field)) continue;
    const auto tip_mm = tip_depth_mm(shaft, key.prepared.camera, diameter_mm);
    const auto tissue = tissue_depth(shaft, key);
    constexpr double kEdge_px = 0.7;
    if (tip_mm && tissue) found.emplace_back(*tip_mm / *tissue, kEdge_px / shaft.half_width_px());
  }
  if (found.empty())
    throw BadDataError(
        "shaft_mm is given, but no key frame shows a straight shaft that reaches in from the rim");
  // Nearest to the tissue the instrument is as far away as that: the upper third.
  std::sort(found.rbegin(), found.rend());
  found.resize((found.size() + 2) / 3);
  std::vector<double> scales;
  for (const auto& one : found) scales.push_back(one.first);
  return middle_of(scales, found[found.size() / 2].second);
}

}  // namespace organbake
