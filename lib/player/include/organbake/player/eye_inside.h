// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "organbake/player/player.h"

namespace organbake {

// Whether the eye lies inside an organ as it is posed now: by the winding number of its proxy
// (van Oosterom & Strackee 1983, solid angles). An open surface has no inside.
bool eye_is_inside(const Player& player, const View& view);

// Of a picture that shows no skin at all: a sentence that says so when the eye is inside.
std::optional<std::string> why_empty(const Player& player, const View& view,
                                     const DrawReport& report);

}  // namespace organbake
