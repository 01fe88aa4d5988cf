// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/image/channel_image.h"

namespace organbake {

// The image by OpenEXR alone, as ZIP at its own level, one thread.
void write_by_openexr(const std::filesystem::path& file, const ChannelImage& image);

}  // namespace organbake
