// SPDX-License-Identifier: GPL-3.0-or-later
#include "pictures/picture_decoders.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/image/exr.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr float kWellExposed = 0.9F, kTooDark = 0.25F;

std::vector<float> numbers(const Channel& channel) {
  if (const auto* floats = std::get_if<std::vector<float>>(&channel.values)) return *floats;
  const auto& whole = channel.uints();
  return {whole.begin(), whole.end()};
}

// The channels that stand for red, green and blue; a grey one stands for all.
std::array<const Channel*, 3> color_channels(const ChannelImage& image, const std::string& name) {
  const std::array<const Channel*, 3> rgb = {image.find("R"), image.find("G"), image.find("B")};
  if (rgb[0] && rgb[1] && rgb[2]) return rgb;
  const Channel* grey = image.find("Y");
  if (!grey || image.find("RY") || image.find("BY"))
    throw BadDataError(name + ": holds no picture: the channels R, G, B or Y are needed");
  if (image.find("Z")) throw BadDataError(name + ": is a depth map (channels Y and Z), no picture");
  return {grey, grey, grey};
}

float exposure(const std::vector<float>& linear) {
  std::vector<float> sorted = linear;
  if (sorted.empty()) return 1;
  const auto bright = sorted.begin() + static_cast<std::ptrdiff_t>(0.999 * (sorted.size() - 1));
  std::nth_element(sorted.begin(), bright, sorted.end());
  if (!(*bright > 0) || (*bright <= 1 && *bright >= kTooDark)) return 1;
  return kWellExposed / *bright;
}

}  // namespace

StoredPicture parse_exr_picture(std::span<const std::byte> bytes, const std::string& name) {
  const ChannelImage image = parse_exr(bytes, name);
  const auto channels = color_channels(image, name);
  const Channel* alpha = image.find("A");
  const std::vector<float> covered = alpha ? numbers(*alpha) : std::vector<float>{};
  StoredPicture picture(Rgb8Image(image.width, image.height));
  picture.pixel_aspect = image.pixel_aspect;
  picture.linear.resize(3 * image.pixel_count());
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> values = numbers(*channels[c]);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const float share = alpha ? covered[k] : 1;
      const float value = share > 0 ? values[k] / share : 0;
      picture.linear[3 * k + c] = std::isfinite(value) ? std::max(value, 0.F) : 0;
    }
  }
  const float gain = exposure(picture.linear);
  for (std::size_t i = 0; i < picture.linear.size(); ++i)
    picture.color.pixels[i] = srgb8_from_linear(gain * picture.linear[i]);
  return picture;
}

}  // namespace organbake
