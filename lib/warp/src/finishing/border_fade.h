// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "organbake/warp/frame.h"
#include "organbake/warp/pixel_box.h"

namespace organbake {

// Fades skin into the background over some pixels beside where it ends against it, for tissue that
// ends where a picture was cut off and not where it turns away: SkinFinish::border_fade_rad.
// Colours alone change. Runs before tools are drawn, and before the outline is smoothed.
class BorderFade {
 public:
  // box: all of the skin. width_px: 2 … SkinFinish::kWidestFade_px, or less for none. Forgets what
  // it faded before.
  void apply(const PixelBox& box, int width_px, const std::array<std::uint8_t, 3>& background,
             Frame& frame);
  // The frame as it was before apply().
  void undo(Frame& frame) const;

 private:
  struct Pixel {
    std::uint32_t at;
    std::array<std::uint8_t, 3> before;
  };
  std::vector<Pixel> faded_;
};

}  // namespace organbake
