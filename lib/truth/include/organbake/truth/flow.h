// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/truth/moment.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// Where the point that each pixel of one picture shows lies in another, px: to, minus from.
struct Flow {
  std::vector<Eigen::Vector2f> px;  // 0 at the background
  // Whether the other picture shows the point as well: it lies inside, is turned to the eye, and
  // nothing lies before it.
  std::vector<std::uint8_t> seen;
};

// Skin moves as it is bound; a tool's points move with its axis. A point that comes to lie behind
// the eye, or on a tool that is taken away, is not seen and does not move.
// The same for any number of threads.
void find_flow(const PixelTruth& from, const Moment& then, const PixelTruth& to, const Moment& now,
               Flow& flow);

}  // namespace organbake
