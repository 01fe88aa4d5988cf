// SPDX-License-Identifier: Apache-2.0
// Access to the planes of an image by name and type, with an error that names the file.
#include "organbake/image/channel_image.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "organbake/core/error.h"

namespace organbake {
namespace {

template <typename T, typename Image>
auto& values_of(Image& image, std::string_view name, const std::string& source) {
  const auto channel = std::ranges::find(image.channels, name, &Channel::name);
  if (channel == image.channels.end())
    throw BadDataError(source + ": has no channel '" + std::string(name) + "'");
  auto* values = std::get_if<std::vector<T>>(&channel->values);
  if (!values)
    throw BadDataError(source + ": channel '" + std::string(name) + "' must be " +
                       (std::is_same_v<T, float> ? "half or float" : "unsigned integer"));
  return *values;
}

}  // namespace

const Channel* ChannelImage::find(std::string_view name) const {
  for (const Channel& channel : channels)
    if (channel.name == name) return &channel;
  return nullptr;
}

const std::vector<float>& ChannelImage::floats(std::string_view name,
                                               const std::string& source) const {
  return values_of<float>(*this, name, source);
}

const std::vector<std::uint32_t>& ChannelImage::uints(std::string_view name,
                                                      const std::string& source) const {
  return values_of<std::uint32_t>(*this, name, source);
}

std::vector<float> ChannelImage::take_floats(std::string_view name, const std::string& source) {
  return std::move(values_of<float>(*this, name, source));
}

std::vector<std::uint32_t> ChannelImage::take_uints(std::string_view name,
                                                    const std::string& source) {
  return std::move(values_of<std::uint32_t>(*this, name, source));
}

Rgb8Image side_by_side(const Rgb8Image& left, const Rgb8Image& right) {
  Rgb8Image both(left.width + right.width, std::max(left.height, right.height));
  for (const auto& [image, x] : {std::pair(&left, 0), std::pair(&right, left.width)})
    for (int y = 0; y < image->height; ++y)
      std::copy_n(image->at(0, y), 3 * image->width, both.at(x, y));
  return both;
}

}  // namespace organbake
