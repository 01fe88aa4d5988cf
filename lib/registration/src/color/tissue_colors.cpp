// SPDX-License-Identifier: GPL-3.0-or-later
// What tells living tissue in a photograph: logarithms of ratios of colour channels, which
// brightness and exposure do not change; the light on it; and how likely each pixel shows the
// organ, learnt round a start.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/ml.hpp>

#include "color/tissue.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kBlack = 0.003f;  // of the range: below, a colour is the sensor's

Vector3f mean_color(const Rgb8Image& photo, int left, int top, int side) {
  constexpr int kBlown = 250;
  const auto& linear = linear_from_srgb8();
  Vector3f sum = Vector3f::Zero();
  int count = 0;
  for (int y = top; y < top + side; ++y)
    for (int x = left; x < left + side; ++x) {
      const std::uint8_t* rgb = photo.at(x, y);
      if (std::max({rgb[0], rgb[1], rgb[2]}) >= kBlown) continue;
      sum += Vector3f(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
      ++count;
    }
  return count > 0 ? Vector3f(sum / static_cast<float>(count)) : sum;
}

using Eigen::Vector3d;

constexpr double kGrazing = 0.03;  // cosine: what faces less is lit as by what is around it

// From the point to the lamp, and how much of its length lies along the normal.
struct Way {
  Vector3d lamp;
  double along, squared;
  bool grazing;

  Way(const Vector3d& point, const Vector3d& normal, const TissueLight::Weights& w)
      : lamp(Vector3d(w[TissueLight::kLampX], w[TissueLight::kLampY], 0) - point),
        along(normal.dot(lamp)),
        squared(lamp.squaredNorm()),
        grazing(along < kGrazing * std::sqrt(squared)) {
    if (grazing) along = kGrazing * std::sqrt(squared);
  }
};

struct Piece {
  int left = 0, top = 0, width = 0, height = 0;  // pixels of the photograph
};

// The organ's circle at its start, with as much round it as a start may be off.
Piece piece_around(const Intrinsics& lens, const ObjectPose& start, double radius_px, int factor) {
  constexpr double kHalf = 2.5;  // radii
  const Eigen::Vector2d center = project(lens, start.center_camera_mm);
  const auto bound = [&](double at, int size) {
    return std::clamp(static_cast<int>(std::clamp(at, 0.0, double(size))), 0, size);
  };
  const int left = bound(center.x() - kHalf * radius_px, lens.width);
  const int right = bound(center.x() + kHalf * radius_px, lens.width);
  const int top = bound(center.y() - kHalf * radius_px, lens.height);
  const int bottom = bound(center.y() + kHalf * radius_px, lens.height);
  return {left, top, (right - left) / factor * factor, (bottom - top) / factor * factor};
}

Rgb8Image cut(const Rgb8Image& photo, const Piece& piece) {
  Rgb8Image image(piece.width, piece.height);
  for (int y = 0; y < piece.height; ++y)
    std::copy_n(photo.at(piece.left, piece.top + y), 3 * piece.width, image.at(0, y));
  return image;
}

// Blown pixels count: what they show has a colour, too, and seldom the organ's.
std::vector<std::uint8_t> counted(const PhotoToRegister& photo, const Piece& piece, int factor) {
  const std::vector<std::uint8_t> field = pixels_in_field(photo.image, photo.mask);
  std::vector<std::uint8_t> valid;
  for (int y = piece.top; y < piece.top + piece.height; y += factor)
    for (int x = piece.left; x < piece.left + piece.width; x += factor) {
      bool counts = true;
      for (int v = y; v < y + factor; ++v)
        for (int u = x; u < x + factor; ++u)
          counts = counts && field[std::size_t(v) * photo.image.width + u];
      valid.push_back(counts);
    }
  return valid;
}

// One row a pixel. Lightness counts half: it is what shadows change.
cv::Mat lab_rows(const Rgb8Image& picture, int factor) {
  constexpr double kBlur_px = 0.35;  // the borders between kinds are no kind of their own
  constexpr float kLightness = 0.5f;
  constexpr double kGrain = 0.5;  // of Lab's units, of which 2.3 are a difference to the eye
  const cv::Mat bytes(picture.height, picture.width, CV_8UC3,
                      const_cast<std::uint8_t*>(picture.pixels.data()));
  cv::Mat small, lab;
  bytes.convertTo(small, CV_32F, 1.0 / 255);
  cv::resize(small, small, {picture.width / factor, picture.height / factor}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {}, kBlur_px);
  cv::cvtColor(small, lab, cv::COLOR_RGB2Lab);
  cv::Mat rows = lab.reshape(1, lab.rows * lab.cols);
  rows.col(0) *= kLightness;
  // A colour that is the same everywhere would be a Gaussian of no width.
  cv::Mat noise(rows.size(), CV_32F);
  cv::RNG(19980915).fill(noise, cv::RNG::NORMAL, 0, kGrain);
  return rows + noise;
}

// A mixture is learnt from about so many pixels.
cv::Mat every_nth(const cv::Mat& rows) {
  constexpr int kEnough = 10'000;
  const int step = std::max(1, rows.rows / kEnough) | 1;  // odd: no columns of pixels
  cv::Mat some;
  for (int i = 0; i < rows.rows; i += step) some.push_back(rows.row(i));
  return some;
}

// The kinds of colour that a picture consists of, a mixture of Gaussians in CIE Lab, and how much
// of each pixel is of which kind. `factor` × `factor` pixels are one; nothing for a picture with
// too few. Row by row; the same for any number of threads.
std::vector<KindShares> color_kinds(const Rgb8Image& picture, int factor) {
  constexpr int kFewest = 20 * kColorKinds;
  if (picture.width / factor * (picture.height / factor) < kFewest) return {};
  const cv::Mat rows = lab_rows(picture, factor);
  cv::theRNG() = cv::RNG(20040902);  // of this thread: it seeds the means
  const auto mixture = cv::ml::EM::create();
  mixture->setClustersNumber(kColorKinds);
  mixture->setCovarianceMatrixType(cv::ml::EM::COV_MAT_DIAGONAL);
  mixture->setTermCriteria({cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01});
  mixture->trainEM(every_nth(rows));
  cv::Mat shares;
  mixture->predict(rows, shares);
  std::vector<KindShares> kinds(static_cast<std::size_t>(rows.rows));
  for (int i = 0; i < rows.rows; ++i)
    for (int k = 0; k < kColorKinds; ++k)
      kinds[static_cast<std::size_t>(i)][k] = static_cast<float>(
          shares.depth() == CV_64F ? shares.at<double>(i, k) : shares.at<float>(i, k));
  return kinds;
}

}  // namespace

std::vector<Vector2f> log_hues(const Rgb8Image& photo, const PhotoLevel& level) {
  std::vector<Vector2f> hues(level.luminance.size());
  for (int y = 0; y < level.intrinsics.height; ++y)
    for (int x = 0; x < level.intrinsics.width; ++x) {
      const Vector3f c =
          mean_color(photo, x * level.factor, y * level.factor, level.factor).array() + kBlack;
      hues[level.index(x, y)] = {std::log(c[0] / c[1]), std::log(c[1] / c[2])};
    }
  return hues;
}

std::vector<TissueLight::Hues> hue_numbers(const PhotoLevel& level,
                                           const std::vector<Vector2f>& hues, const Prediction& p,
                                           const std::vector<WeightedPixel>& pixels) {
  constexpr double kLeastSpread = 0.05, kFarthest = 3;
  Eigen::Array2d sum(0, 0), sum2(0, 0);
  double weight = 0;
  for (const WeightedPixel& pixel : pixels) {
    const double w = pixel.trust * p.coverage[p.index(pixel.x, pixel.y)];
    const Eigen::Array2d h = hues[level.index(pixel.x, pixel.y)].cast<double>();
    weight += w;
    sum += w * h;
    sum2 += w * h * h;
  }
  const Eigen::Array2d mean = sum / std::max(1e-9, weight);
  const Eigen::Array2d spread =
      (sum2 / std::max(1e-9, weight) - mean * mean).max(0).sqrt().max(kLeastSpread);
  std::vector<TissueLight::Hues> numbers;
  numbers.reserve(pixels.size());
  for (const WeightedPixel& pixel : pixels) {
    const Eigen::Array2d h =
        ((hues[level.index(pixel.x, pixel.y)].cast<double>().array() - mean) / spread)
            .max(-kFarthest)
            .min(kFarthest);
    TissueLight::Hues number;
    number << h[0], h[1], h[0] * h[0] - 1, h[1] * h[1] - 1, h[0] * h[1];
    numbers.push_back(number);
  }
  return numbers;
}

// Lamp, beam, fall-off and albedo of living tissue as logarithms, where they add up, and their
// slopes.

TissueLight::Expected TissueLight::expected() {
  Expected e{Weights::Zero(), Weights::Zero()};
  e.sd[kGain] = 100;                          // exposure is anyone's
  e.sd[kLampX] = e.sd[kLampY] = 6;            // mm: the rim of a laparoscope
  e.sd[kTiltU] = e.sd[kTiltV] = 0.5;          // a beam that points half a picture aside
  e.mean[kBeam] = -1, e.sd[kBeam] = 1.5;      // weaker to the sides
  e.sd[kFalloff] = 0.3;                       // of the power of the distance
  e.mean[kGround] = -5.3, e.sd[kGround] = 1;  // dark
  for (int i = 0; i < kHues; ++i) e.sd[kHue + i] = i < 2 ? 0.3 : 0.1;
  return e;
}

double log_radiance(const Vector3d& point, const Vector3d& normal, const TissueLight::Weights& w,
                    double reference_mm) {
  const Way way(point, normal, w);
  const double u = point.x() / point.z(), v = point.y() / point.z();
  return w[TissueLight::kGain] + std::log(way.along) - 1.5 * std::log(way.squared) +
         2 * std::log(reference_mm) + w[TissueLight::kTiltU] * u + w[TissueLight::kTiltV] * v +
         w[TissueLight::kBeam] * std::log(1 + u * u + v * v) +
         w[TissueLight::kFalloff] * std::log(point.norm() / reference_mm);
}

LogRadianceSlopes log_radiance_slopes(const Vector3d& point, const Vector3d& normal,
                                      const TissueLight::Weights& w, double reference_mm) {
  const Way way(point, normal, w);
  const double u = point.x() / point.z(), v = point.y() / point.z(), q = 1 + u * u + v * v;
  LogRadianceSlopes s;
  s.by_normal = way.grazing ? Vector3d::Zero() : Vector3d(way.lamp / way.along);
  const Vector3d by_cosine = way.grazing ? Vector3d::Zero() : Vector3d(normal / way.along);
  const Vector3d by_lamp = by_cosine - 3 / way.squared * way.lamp;
  const double by_u = w[TissueLight::kTiltU] + 2 * w[TissueLight::kBeam] * u / q;
  const double by_v = w[TissueLight::kTiltV] + 2 * w[TissueLight::kBeam] * v / q;
  s.by_point = -by_lamp + Vector3d(by_u, by_v, -by_u * u - by_v * v) / point.z() +
               w[TissueLight::kFalloff] / point.squaredNorm() * point;
  s.by_weight << 1, by_lamp.x(), by_lamp.y(), u, v, std::log(q),
      std::log(point.norm() / reference_mm);
  return s;
}

// Colours of a photograph round an organ's start as a mixture of few Gaussians in CIE Lab (EM;
// OpenCV), and from them how likely each pixel shows the organ. Which kinds are the organ's is
// learnt from the pose, so that no colour is given.

ColorScene ColorScene::around(const RegisteredSurface& surface, const PhotoToRegister& photo,
                              const ObjectPose& start) {
  constexpr double kFineEnough_px = 50;  // radius: more pixels make the outline no clearer
  ColorScene scene;
  const double radius_px =
      photo.intrinsics.fx * surface.radius_mm() / std::max(1e-9, start.center_camera_mm.z());
  int factor = 1;
  while (radius_px / factor > kFineEnough_px && factor < 64) factor *= 2;
  scene.radius_px = radius_px / factor;
  const Piece piece = piece_around(photo.intrinsics, start, radius_px, factor);
  PhotoLevel& level = scene.level;
  level.factor = factor;
  level.intrinsics = reduced(photo.intrinsics, factor);
  level.intrinsics.width = piece.width / factor;
  level.intrinsics.height = piece.height / factor;
  level.intrinsics.cx -= double(piece.left) / factor;
  level.intrinsics.cy -= double(piece.top) / factor;
  scene.kinds = color_kinds(cut(photo.image, piece), factor);
  if (scene.empty()) return scene;
  level.valid = counted(photo, piece, factor);
  level.rays = pixel_rays(level.intrinsics);
  return scene;
}

std::vector<float> covered(const RegisteredSurface& surface, const PhotoLevel& level,
                           const ObjectPose& pose, double blur_px) {
  constexpr double kLeastBlur_px = 0.3;
  const ShadingBasis basis(LightModel::camera, pose.center_camera_mm.norm());
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(), {}, p);
  std::vector<float> cover(level.valid.size(), 0);
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x)
      cover[level.index(x, y)] = p.coverage[p.index(x, y)];
  if (blur_px < kLeastBlur_px) return cover;
  cv::Mat image(level.intrinsics.height, level.intrinsics.width, CV_32F, cover.data());
  cv::GaussianBlur(image, image, {}, blur_px);
  return cover;
}

std::vector<float> likely_organ(const ColorScene& scene, const std::vector<float>& cover) {
  constexpr double kUnseen = 1e-3;  // share of a kind that neither side has
  std::array<double, kColorKinds> inside{}, outside{}, organ{};
  double all_inside = 0, all_outside = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    if (!scene.level.valid[i]) continue;
    all_inside += cover[i];
    all_outside += 1 - cover[i];
    for (int k = 0; k < kColorKinds; ++k) {
      inside[k] += cover[i] * scene.kinds[i][k];
      outside[k] += (1 - cover[i]) * scene.kinds[i][k];
    }
  }
  for (int k = 0; k < kColorKinds; ++k) {
    const double in = inside[k] / std::max(1e-9, all_inside) + kUnseen;
    const double out = outside[k] / std::max(1e-9, all_outside) + kUnseen;
    organ[k] = in / (in + out);
  }
  std::vector<float> likely(cover.size(), 0.5f);
  for (std::size_t i = 0; i < cover.size(); ++i) {
    double sum = 0;
    for (int k = 0; k < kColorKinds; ++k) sum += organ[k] * scene.kinds[i][k];
    likely[i] = static_cast<float>(sum);
  }
  return likely;
}

}  // namespace organbake
