// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "organbake/player/player.h"

namespace organbake {

// The depth (mm) at which a pixel's ray first meets the skin as it lies now, whatever tools stand
// before it and without its relief; nothing where it meets none.
std::optional<double> skin_depth_mm(const Player& player, const View& view,
                                    const Eigen::Vector2i& pixel);

}  // namespace organbake
