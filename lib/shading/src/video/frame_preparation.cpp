// SPDX-License-Identifier: GPL-3.0-or-later
// What is done to a frame before anything is read from it, and how frames of a clip are compared.
// Interlaced frames are told by combs: motion between two fields leaves teeth that no edge of a
// scene has.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/camera.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

constexpr double kSquare = 1e-3;   // aspects nearer to 1 than this are rounding
constexpr double kMostOblong = 4;  // of any standard, anamorphic or half-width stereo

PixelSize square_size(const StoredPicture& picture) {
  const double aspect = picture.pixel_aspect;
  const int width = picture.color.width, height = picture.color.height;
  if (std::abs(aspect - 1) < kSquare) return {width, height};
  if (!(aspect <= kMostOblong && aspect >= 1 / kMostOblong))
    throw BadDataError(
        "its pixels are said to be " + to_text(aspect) +
        " times as wide as high; write the true pixel aspect into the file, or none");
  if (aspect > 1) return {static_cast<int>(std::lround(width * aspect)), height};
  return {width, static_cast<int>(std::lround(height / aspect))};
}

void turn_upright(cv::Mat& image, Turn turn) {
  if (swaps_sides(turn)) cv::transpose(image, image);
  // After the transposition (which is Exif's 5) what is left is to mirror, to flip, or both.
  const bool mirrored = turn == Turn::mirror || turn == Turn::half || turn == Turn::clockwise ||
                        turn == Turn::transverse;
  const bool flipped = turn == Turn::flip || turn == Turn::half || turn == Turn::counterclockwise ||
                       turn == Turn::transverse;
  if (mirrored && flipped) cv::flip(image, image, -1);
  if (mirrored && !flipped) cv::flip(image, image, 1);
  if (flipped && !mirrored) cv::flip(image, image, 0);
}

template <class Value>
std::vector<Value> upright(std::vector<Value>& values, int type, const StoredPicture& picture,
                           PixelSize square) {
  cv::Mat image(picture.color.height, picture.color.width, type, values.data());
  if (square.width != image.cols || square.height != image.rows)
    cv::resize(image, image, {square.width, square.height}, 0, 0, cv::INTER_CUBIC);
  turn_upright(image, picture.turn);
  if (!image.isContinuous()) image = image.clone();
  const auto* first = image.ptr<Value>();
  return {first, first + image.total() * 3};
}

// A comb's tooth: the pixel lies beyond the one before and the one after it, which agree with each
// other, as it does with the next but one.
bool is_tooth(int before, int here, int after, int next) {
  constexpr int kTooth = 12;
  const bool beyond_both = std::abs(here - before) > kTooth && std::abs(here - after) > kTooth &&
                           (here - before) * (here - after) > 0;
  return beyond_both && std::abs(before - after) < kTooth / 2 && std::abs(here - next) < kTooth / 2;
}

// Whether `steps`, of neighbouring lines, are large at every `side`-th line and small at all
// others.
bool steps_every(std::size_t side, const std::vector<double>& steps) {
  constexpr double kLeast = 0.5, kBetween = 0.25;  // levels; of the large ones
  std::vector<double> sums(side, 0);
  for (std::size_t i = 0; i < steps.size(); ++i) sums[i % side] += steps[i];
  std::sort(sums.begin(), sums.end());
  const double count = static_cast<double>(steps.size()) / static_cast<double>(side);
  return sums.back() / count >= kLeast && sums[side - 2] < kBetween * sums.back();
}

}  // namespace

int squares_px(const Rgb8Image& frame) {
  constexpr int kLargest = 32;
  std::vector<double> columns, rows;
  for (int x = 1; x < frame.width; ++x) {
    double sum = 0;
    for (int y = 0; y < frame.height; ++y)
      sum += std::abs(frame.at(x, y)[1] - frame.at(x - 1, y)[1]);
    columns.push_back(sum / frame.height);
  }
  for (int y = 1; y < frame.height; ++y) {
    double sum = 0;
    for (int x = 0; x < frame.width; ++x)
      sum += std::abs(frame.at(x, y)[1] - frame.at(x, y - 1)[1]);
    rows.push_back(sum / frame.width);
  }
  // The largest: at every eighth line is at every second one, too.
  for (int side = std::min(kLargest, std::min(frame.width, frame.height) / 4); side > 1; --side)
    if (steps_every(static_cast<std::size_t>(side), columns) &&
        steps_every(static_cast<std::size_t>(side), rows))
      return side;
  return 1;
}

bool is_combed(const Rgb8Image& frame) {
  constexpr double kShare = 0.01, kOverDither = 2;
  std::size_t teeth = 0, across = 0, looked = 0;
  for (int y = 1; y + 2 < frame.height; y += 2)
    for (int x = 0; x < frame.width; x += 4) {
      ++looked;
      const auto level = [&](int right, int down) { return int(frame.at(x + right, y + down)[1]); };
      teeth += is_tooth(level(0, -1), level(0, 0), level(0, 1), level(0, 2));
      if (x > 0 && x + 2 < frame.width)
        across += is_tooth(level(-1, 0), level(0, 0), level(1, 0), level(2, 0));
    }
  // A palette's dither and noise have as many along a row as across it.
  return looked > 0 && static_cast<double>(teeth) > kShare * static_cast<double>(looked) &&
         static_cast<double>(teeth) > kOverDither * static_cast<double>(across);
}

void deinterlace(StoredPicture& frame) {
  const int height = frame.color.height;
  const std::size_t row = 3 * std::size_t(frame.color.width);
  for (int y = 1; y + 1 < height; y += 2) {
    std::uint8_t* here = frame.color.at(0, y);
    for (std::size_t i = 0; i < row; ++i)
      here[i] = static_cast<std::uint8_t>((*(here + i - row) + here[i + row] + 1) / 2);
    if (frame.linear.empty()) continue;
    float* light = &frame.linear[row * static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < row; ++i) light[i] = 0.5F * (*(light + i - row) + light[i + row]);
  }
}

double sharpness(const Rgb8Image& frame) {
  double sum = 0;
  for (int y = 1; y + 1 < frame.height; ++y)
    for (int x = 1; x + 1 < frame.width; ++x) {
      const double l = 4 * frame.at(x, y)[1] - frame.at(x - 1, y)[1] - frame.at(x + 1, y)[1] -
                       frame.at(x, y - 1)[1] - frame.at(x, y + 1)[1];
      sum += l * l;
    }
  return sum / (double(frame.width) * frame.height + 1e-9);
}

double brightness(const Rgb8Image& frame) {
  double sum = 0;
  for (std::size_t k = 1; k < frame.pixels.size(); k += 3) sum += frame.pixels[k];
  return sum / (double(frame.width) * frame.height + 1e-9);
}

bool flickers(const std::vector<double>& brightness) {
  constexpr double kJump = 0.25, kDark = 4;  // of ln; levels that black frames differ by
  constexpr double kMostly = 0.5;
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < brightness.size(); ++i)
    jumps += std::abs(std::log((brightness[i] + kDark) / (brightness[i - 1] + kDark))) > kJump;
  return brightness.size() > 2 &&
         static_cast<double>(jumps) > kMostly * static_cast<double>(brightness.size() - 1);
}

double mean_difference(const Rgb8Image& a, const Rgb8Image& b) {
  if (a.width != b.width || a.height != b.height) return std::numeric_limits<double>::infinity();
  double sum = 0;
  const std::size_t pixels = a.pixels.size() / 3;
  for (std::size_t k = 0; k < pixels; ++k)
    sum += std::abs(int(a.pixels[3 * k + 1]) - int(b.pixels[3 * k + 1]));
  return sum / (static_cast<double>(pixels) + 1e-9);
}

PixelSize upright_size(const StoredPicture& picture) {
  const PixelSize size = square_size(picture);
  return swaps_sides(picture.turn) ? PixelSize{size.height, size.width} : size;
}

void make_upright(StoredPicture& picture) {
  const PixelSize square = square_size(picture), size = upright_size(picture);
  const PixelSize stored{picture.color.width, picture.color.height};
  if (square != stored || picture.turn != Turn::none) {
    if (!picture.linear.empty()) {
      picture.linear = upright(picture.linear, CV_32FC3, picture, square);
      for (float& value : picture.linear) value = std::max(value, 0.F);  // cubics undershoot
    }
    picture.color.pixels = upright(picture.color.pixels, CV_8UC3, picture, square);
    picture.color.width = size.width;
    picture.color.height = size.height;
  }
  picture.turn = Turn::none;
  picture.pixel_aspect = 1;
}

namespace {

// Where the pinhole's pixel lies among the centres of the lens's pixels.
Eigen::Vector2d source_of(int x, int y, const Intrinsics& lens, const Intrinsics& pinhole) {
  const Eigen::Vector3d ray((x + 0.5 - pinhole.cx) / pinhole.fx,
                            (y + 0.5 - pinhole.cy) / pinhole.fy, 1);
  return project(lens, ray) - Eigen::Vector2d(0.5, 0.5);
}

// The four pixels round a place, and how far between them it lies.
struct CellPosition {
  int x, y;
  double u, v;

  double of(double a, double b, double c, double d) const {
    return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
  }
};

// Calls put(x, y, between) for each of the pinhole's pixels whose source lies inside.
template <class Put>
void from_inside(const Intrinsics& lens, const Intrinsics& pinhole, const Put& put) {
  for (int y = 0; y < pinhole.height; ++y)
    for (int x = 0; x < pinhole.width; ++x) {
      const Eigen::Vector2d at = source_of(x, y, lens, pinhole);
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < lens.width - 1 && at.y() < lens.height - 1))
        continue;
      const int x0 = static_cast<int>(at.x()), y0 = static_cast<int>(at.y());
      put(x, y, CellPosition{x0, y0, at.x() - x0, at.y() - y0});
    }
}

}  // namespace

Rgb8Image undistorted(const Rgb8Image& picture, const Intrinsics& lens, const Intrinsics& pinhole) {
  Rgb8Image straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    for (int c = 0; c < 3; ++c)
      straight.at(x, y)[c] = static_cast<std::uint8_t>(
          b.of(picture.at(b.x, b.y)[c], picture.at(b.x + 1, b.y)[c], picture.at(b.x, b.y + 1)[c],
               picture.at(b.x + 1, b.y + 1)[c]) +
          0.5);
  });
  return straight;
}

Plane undistorted(const Plane& plane, const Intrinsics& lens, const Intrinsics& pinhole) {
  Plane straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    straight.at(x, y) = static_cast<float>(
        b.of(double(plane.at(b.x, b.y)), double(plane.at(b.x + 1, b.y)),
             double(plane.at(b.x, b.y + 1)), double(plane.at(b.x + 1, b.y + 1))));
  });
  return straight;
}

Mask undistorted(const Mask& mask, const Intrinsics& lens, const Intrinsics& pinhole) {
  Mask straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    straight.at(x, y) = mask.at(b.x + (b.u < 0.5 ? 0 : 1), b.y + (b.v < 0.5 ? 0 : 1));
  });
  return straight;
}

std::string told_of_fisheye(const Intrinsics& lens) {
  if (lens.model != LensModel::fisheye) return "";
  constexpr double kDegrees = 57.29577951308232;
  const auto degrees = [](double angle_rad) { return to_text(kDegrees * angle_rad, 0); };
  const double left = angle_across_rad(pinhole_of(lens));
  return "the lens is a fisheye of " + degrees(angle_across_rad(lens)) +
         " degrees across; its middle " + degrees(left) +
         " degrees are straightened to a pinhole's picture, and what lies beyond is left out";
}

}  // namespace organbake
