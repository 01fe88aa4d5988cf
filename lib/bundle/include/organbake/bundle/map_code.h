// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// A camera's maps as the player takes them, in a form that deflate packs well: each texel in use is
// told by how it differs from what its neighbours foretell. Colour and confidence come back as the
// bytes that a player makes of them anyway (255·√linear; 255 = sure), faces exactly, depth and
// height to a 128th of a texel of maps of 512 pixels a side or more, of smaller ones to as much of
// their view, or where they range over more to a 65,535th of their range. Texels
// that no player draws, of no face or no confidence, come back as background.
std::vector<std::byte> coded_maps(const CameraMaps& maps, const Intrinsics& lens);
// lens: the camera's; faces: how many the shell's surface has. Throws BadDataError, beginning with
// `name`, for anything that coded_maps() does not write and for what check_maps() refuses.
CameraMaps decoded_maps(std::span<const std::byte> bytes, const Intrinsics& lens, std::size_t faces,
                        const std::string& name);

}  // namespace organbake
