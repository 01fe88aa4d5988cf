// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "registration/photo_pyramid.h"

namespace organbake {

// What stands out from the background that the picture's border shows.
struct Foreground {
  double area_px = 0;
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
};

// Nothing when the border is not plain, or next to nothing or nearly all stands out from it.
std::optional<Foreground> find_foreground(const PhotoLevel& level);

}  // namespace organbake
