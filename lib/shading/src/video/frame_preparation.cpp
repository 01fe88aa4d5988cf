// SPDX-License-Identifier: GPL-3.0-or-later
// What is done to a frame before anything is read from it, and how frames of a clip are compared.
// Interlaced frames are told by combs: motion between two fields leaves teeth that no edge of a
// scene has.
#include "organbake/shading/frame_preparation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

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

}  // namespace

bool is_combed(const Rgb8Image& frame) {
  // A comb: the pixel lies beyond both vertical neighbours, which agree with each other.
  constexpr int kTooth = 12;
  constexpr double kShare = 0.01;
  std::size_t teeth = 0, looked = 0;
  for (int y = 1; y + 2 < frame.height; y += 2)
    for (int x = 0; x < frame.width; x += 4) {
      const int above = frame.at(x, y - 1)[1], here = frame.at(x, y)[1];
      const int below = frame.at(x, y + 1)[1], next = frame.at(x, y + 2)[1];
      ++looked;
      const bool between_fields = std::abs(here - above) > kTooth &&
                                  (here - above) * (here - below) > 0 &&
                                  std::abs(here - below) > kTooth;
      teeth += between_fields && std::abs(above - below) < kTooth / 2 &&
               std::abs(here - next) < kTooth / 2;
    }
  return looked > 0 && teeth > kShare * static_cast<double>(looked);
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

}  // namespace organbake
