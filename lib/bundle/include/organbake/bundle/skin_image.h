// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"

namespace organbake {

inline constexpr const char* kSkinFile = "skin.exr";

// A smooth skin as it is stored: row = node of the lattice over the proxy, column = one of its
// carriers; channels `vertex` (uint: the proxy's vertex, or all bits set for none) and `weight`
// (float). Weights come back to a float's precision, their sums to a double's.
ChannelImage skin_to_image(const SmoothSkin& skin);
// Throws BadDataError naming `name`.
SmoothSkin skin_from_image(const ChannelImage& image, const std::string& name,
                           const TriangleMesh& proxy);

}  // namespace organbake
