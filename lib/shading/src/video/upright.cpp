// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_preparation.h"

#include <algorithm>
#include <cmath>
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
