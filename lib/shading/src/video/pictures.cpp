// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures for people to look at: masks, depth, relief, strips of frames.
#include "organbake/shading/pictures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

std::uint8_t byte_of(double share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
}

Rgb8Image relief_picture(const FrameDepth& result) {
  Rgb8Image picture(result.depth.width, result.depth.height);
  const Eigen::Vector3f light = Eigen::Vector3f(-0.5F, -0.6F, -0.7F).normalized();
  for (std::size_t k = 0; k < result.depth.size(); ++k) {
    if (!std::isfinite(result.depth.values[k])) continue;
    const std::uint8_t value = byte_of(0.08 + 0.9 * std::max(0.F, result.normals[k].dot(light)));
    std::fill_n(&picture.pixels[3 * k], 3, value);
  }
  return picture;
}

// Nearest pixel, whole steps.
Rgb8Image reduced(const Rgb8Image& image, int side) {
  const int step = std::max(1, (image.width + side - 1) / side);
  Rgb8Image small(std::max(1, image.width / step), std::max(1, image.height / step));
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      std::copy_n(image.at(x * step, y * step), 3, small.at(x, y));
  return small;
}

void paste(const Rgb8Image& from, int left, int top, Rgb8Image& to) {
  for (int y = 0; y < from.height; ++y)
    std::copy_n(from.at(0, y), 3 * std::size_t(from.width), to.at(left, top + y));
}

// Near is bright and warm, far is dark and cold, nothing is black; from the 2nd to the 98th
// percent.
Rgb8Image depth_picture(const Plane& depth) {
  Rgb8Image picture(depth.width, depth.height);
  std::vector<float> finite;
  // Two percentiles: a sample is enough.
  const std::size_t stride = 1 + depth.size() / 20000;
  for (std::size_t k = 0; k < depth.size(); k += stride)
    if (std::isfinite(depth.values[k])) finite.push_back(depth.values[k]);
  if (finite.empty()) return picture;
  std::sort(finite.begin(), finite.end());
  const double low = finite[finite.size() / 50],
               high = finite[finite.size() - 1 - finite.size() / 50];
  for (std::size_t k = 0; k < depth.size(); ++k) {
    if (!std::isfinite(depth.values[k])) continue;
    const double far = std::clamp((depth.values[k] - low) / std::max(high - low, 1e-9), 0.0, 1.0);
    std::uint8_t* p = &picture.pixels[3 * k];
    p[0] = byte_of(1.05 - far);
    p[1] = byte_of(0.9 - 0.8 * far);
    p[2] = byte_of(0.25 + 0.35 * std::sin(3.14159 * far));
  }
  return picture;
}

}  // namespace

Rgb8Image mask_picture(const PreparedFrame& frame) {
  Rgb8Image picture(frame.color.width, frame.color.height);
  for (std::size_t k = 0; k < frame.field.size(); ++k) {
    std::uint8_t* p = &picture.pixels[3 * k];
    if (!frame.field.values[k]) continue;
    std::fill_n(p, 3, std::uint8_t{96});
    if (frame.highlights.values[k]) std::fill_n(p, 3, std::uint8_t{255});
    if (frame.instruments.values[k]) {
      p[0] = 32;
      p[1] = 96;
      p[2] = 255;
    }
  }
  return picture;
}

Rgb8Image grey_picture(const Plane& share) {
  Rgb8Image picture(share.width, share.height);
  for (std::size_t k = 0; k < share.size(); ++k)
    std::fill_n(&picture.pixels[3 * k], 3, byte_of(share.values[k]));
  return picture;
}

Rgb8Image frame_strip(const PreparedFrame& frame, const FrameDepth& result, int side) {
  const Rgb8Image parts[4] = {reduced(frame.color, side), reduced(mask_picture(frame), side),
                              reduced(depth_picture(result.depth), side),
                              reduced(relief_picture(result), side)};
  Rgb8Image strip(4 * parts[0].width, parts[0].height);
  for (int i = 0; i < 4; ++i) paste(parts[i], i * parts[0].width, 0, strip);
  return strip;
}

Rgb8Image stacked(const std::vector<Rgb8Image>& rows) {
  int width = 0, height = 0;
  for (const Rgb8Image& row : rows) {
    width = std::max(width, row.width);
    height += row.height;
  }
  Rgb8Image all(width, height);
  int top = 0;
  for (const Rgb8Image& row : rows) {
    paste(row, 0, top, all);
    top += row.height;
  }
  return all;
}

}  // namespace organbake
