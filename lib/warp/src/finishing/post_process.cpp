// SPDX-License-Identifier: Apache-2.0
#include "finishing/post_process.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "finishing/hole_fill.h"
#include "finishing/see_through.h"
#include "finishing/slit_fill.h"
#include "finishing/tool_shadows.h"
#include "organbake/warp/draw_options.h"
#include "picture/phase_clock.h"

namespace organbake {

PostProcess::Pixel PostProcess::pixel_of(const Frame& frame, std::size_t at) {
  const std::uint8_t* const rgb = &frame.color.pixels[3 * at];
  return {static_cast<std::uint32_t>(at),
          {rgb[0], rgb[1], rgb[2]},
          frame.cover[at],
          frame.depth_mm.empty() ? 0 : frame.depth_mm[at]};
}

void PostProcess::open(const PixelBox& drawn, const SkinDepth& depth, float deeper_mm,
                       Frame& frame) {
  for (const std::uint32_t pixel : find_see_through(drawn, depth, deeper_mm)) {
    opened_.push_back(pixel_of(frame, pixel));
    frame.cover[pixel] = Cover::background;
  }
}

void PostProcess::keep(const PixelBox& box, const Frame& frame) {
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      hidden_.push_back(pixel_of(frame, std::size_t(y) * frame.color.width + x));
    }
  }
}

void PostProcess::draw_tools(const View& view, const DrawOptions& options, Frame& frame) {
  const bool shadows = options.light == DrawnLight::scope;
  const std::vector<SolidBlock> blocks = solid_blocks(options.solids, view);
  const std::vector<SolidBlock> shaded =
      shadows ? solid_blocks(with_shadows(options.solids), view) : std::vector<SolidBlock>();
  for (const SolidBlock& block : shadows ? shaded : blocks) keep(block.box, frame);
  shade_skin_by_solids(options.solids, shaded, view, light_mm_, frame);
  draw_solids(options.solids, blocks, view, frame);
}

void PostProcess::apply(const View& view, const DrawOptions& options, const PixelBox& drawn,
                        const SkinDepth& depth, float deeper_mm, Frame& frame, DrawReport& report) {
  PhaseClock clock(options.measure);
  drawn_ = drawn;
  opened_.clear();
  hidden_.clear();
  if (options.fill_holes) open(drawn, depth, deeper_mm, frame);
  skin_.read_with_border(drawn, frame);
  const std::size_t slits = fill_slits(skin_, options.fill_holes, frame);
  const HoleCounts holes = fill_holes(skin_, options.fill_holes, frame);
  report.holes_before = slits + holes.before;
  report.holes_after = holes.after;
  const int fade_px = finish_.border_fade_px(view.camera.intrinsics.fx);
  fade_.apply(drawn, options.smooth_outline ? fade_px : 0, options.background, frame);
  if (!options.solids.empty()) {
    clock.lap(report.times.fill, report.critical_path.fill);
    draw_tools(view, options, frame);
    clock.lap(report.times.tools, report.critical_path.tools);
    skin_.read_with_border(drawn, frame);
  }
  if (!options.smooth_outline) skin_ = {};
  edges_.find(skin_, depth, deeper_mm);
  outline_.soften(edges_, frame);
  clock.lap(report.times.fill, report.critical_path.fill);
}

void PostProcess::undo(const Background& background, Frame& frame) const {
  outline_.undo(frame);
  const auto restore = [&](const Pixel& pixel, float depth) {
    std::copy(pixel.color.begin(), pixel.color.end(),
              &frame.color.pixels[3 * std::size_t(pixel.at)]);
    frame.cover[pixel.at] = pixel.cover;
    if (!frame.depth_mm.empty()) frame.depth_mm[pixel.at] = depth;
  };
  for (const Pixel& pixel : hidden_) restore(pixel, pixel.depth);
  fade_.undo(frame);
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  for (int y = drawn_.y0; y < drawn_.y1; ++y) {
    const Cover* const row = frame.cover.data() + std::size_t(y) * frame.color.width;
    const Cover* const end = row + drawn_.x1;
    // Filled pixels are rare: the library finds the next one.
    for (const Cover* at = row + drawn_.x0; at < end; ++at) {
      at = static_cast<const Cover*>(std::memchr(at, static_cast<int>(Cover::filled), end - at));
      if (!at) break;
      restore({static_cast<std::uint32_t>(at - frame.cover.data()), background.color(),
               Cover::background, 0},
              kNothing);
    }
  }
  for (const Pixel& pixel : opened_) restore(pixel, pixel.depth);
}

}  // namespace organbake
