// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "organbake/player/player.h"

namespace organbake {

// Whether the eye lies inside an organ as it is posed now: by the winding number of its proxy
// (van Oosterom & Strackee 1983, solid angles). An open surface has no inside.
bool eye_is_inside(const Player& player, const View& view);

// Whether some skin lies nearer to the eye than it can be drawn.
bool lens_touches_skin(const Player& player, const View& view);

// Of a picture that shows no skin at all: a sentence when that is so because the eye is inside an
// organ or too near to one. Nothing where it looks past all of them.
std::optional<std::string> why_empty(const Player& player, const View& view,
                                     const DrawReport& report);

}  // namespace organbake
