// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// How a camera's images are split into macro- and microstructure (the paper, 2.1.4). `proxy` is
// the split of the shell map, which the player draws by; the filters are the paper's own.
enum class MicroSplit {
  proxy,
  gaussian,
  bilateral,  // Tomasi & Manduchi 1998: keeps jumps of more than the size
};

// The microstructure that a filter leaves of one camera's maps:
//   Y          depth − filtered depth, mm (float): added to a deformed macrostructure
//   intensity  luminance / filtered luminance (half; filtered as a logarithm, Durand & Dorsey
//              2002): multiplied with the light on one
// Background: 0 and 1; it takes no part, the filters see the nearest skin there. OpenCV filters.
// Throws UsageError for the split `proxy`, which the maps hold already.
ChannelImage filtered_detail(const CameraMaps& maps, const Intrinsics& lens, MicroSplit split);

}  // namespace organbake
