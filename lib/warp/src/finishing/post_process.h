// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "drawing/resolve.h"
#include "finishing/border_fade.h"
#include "finishing/cover_mask.h"
#include "finishing/front_edges.h"
#include "finishing/outline.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/pixel_box.h"
#include "organbake/warp/solids.h"
#include "organbake/warp/view.h"
#include "picture/skin_depth.h"

namespace organbake {

struct DrawOptions;
struct DrawReport;

// The last steps of a frame, after its tiles: slits opened, holes filled, borders that a picture
// cut faded, tools drawn, the outline smoothed. Remembers what it covers up, so that the next frame
// of the same view can take it back and draw the tiles that changed alone.
class PostProcess {
 public:
  // light_mm: of the light at the scope, from the eye, camera axes: by it tools throw shadows.
  explicit PostProcess(const Eigen::Vector3d& light_mm, const SkinFinish& finish = {})
      : light_mm_(light_mm), finish_(finish) {}

  // drawn: everything but the background. depth: of its skin. deeper_mm: skin at least so far
  // behind other skin is not one surface with it.
  void apply(const View& view, const DrawOptions& options, const PixelBox& drawn,
             const SkinDepth& depth, float deeper_mm, Frame& frame, DrawReport& report);
  // The frame as it was before apply().
  void undo(const Background& background, Frame& frame) const;

 private:
  struct Pixel {
    std::uint32_t at;
    std::array<std::uint8_t, 3> color;
    Cover cover;
    float depth;  // 0 where the frame keeps none
  };
  static Pixel pixel_of(const Frame& frame, std::size_t at);
  void keep(const PixelBox& box, const Frame& frame);
  void draw_tools(const View& view, const DrawOptions& options, Frame& frame);
  void open(const PixelBox& drawn, const SkinDepth& depth, float deeper_mm, Frame& frame);

  Eigen::Vector3d light_mm_;
  SkinFinish finish_;
  PixelBox drawn_;
  CoverMask skin_;             // with a border
  std::vector<Pixel> opened_;  // as they were
  std::vector<Pixel> hidden_;  // under the tools' box
  BorderFade fade_;
  FrontEdges edges_;  // of skin_
  Outline outline_;
};

}  // namespace organbake
