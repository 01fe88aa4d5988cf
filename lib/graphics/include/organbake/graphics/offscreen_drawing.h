// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "organbake/graphics/graphics_drawing.h"
#include "organbake/graphics/offscreen_context.h"

namespace organbake {

// Graphics hardware, or a driver that does as if, without a window: from its making to its end on
// one thread.
class OffscreenDrawing : public OrganDrawing {
 public:
  OffscreenDrawing() = default;

  GraphicsDevice device() const { return device_; }
  std::size_t table_bytes() const { return drawing_.table_bytes(); }
  std::string refusal(const std::vector<JointDrawing::Organ>& organs, const View& view,
                      const DrawOptions& options) const override {
    return drawing_.refusal(organs, view, options);
  }
  DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options, Frame& frame) override {
    return drawing_.draw(organs, view, options, frame);
  }

 private:
  OffscreenContext context_;  // first: it ends last
  GraphicsDevice device_ = current_graphics_device();
  GraphicsDrawing drawing_;
};

}  // namespace organbake
