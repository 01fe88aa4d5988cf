// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// An image of named planes in a form that needs no library to read and that deflate packs well:
// exact, plane by plane, the numbers' lowest bytes first, then the next ones.
std::vector<std::byte> packed_image(const ChannelImage& image);
// Throws BadDataError, beginning with `name`.
ChannelImage unpacked_image(std::span<const std::byte> bytes, const std::string& name);

}  // namespace organbake
