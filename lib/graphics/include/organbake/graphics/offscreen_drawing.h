// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "organbake/graphics/graphics_drawing.h"

namespace organbake {

// A context of OpenGL without a window or a display, by EGL: current from its making to its end, on
// the thread that made it.
class OffscreenContext {
 public:
  enum class Kind { desktop, embedded };  // OpenGL 3.3 core; OpenGL ES 3.0

  // Of real graphics hardware where there is any, else of a software one. Throws GraphicsError
  // where EGL or a driver is missing.
  explicit OffscreenContext(Kind kind = Kind::desktop);
  ~OffscreenContext() { close(); }
  OffscreenContext(const OffscreenContext&) = delete;

 private:
  // Whether it is a context now, and of hardware or not.
  std::optional<GraphicsDevice> open(void* display, bool embedded);
  void close();

  void *display_ = nullptr, *context_ = nullptr;  // EGL's
};

// Graphics hardware, or a driver that does as if, without a window: from its making to its end on
// one thread.
class OffscreenDrawing : public OrganDrawing {
 public:
  OffscreenDrawing() = default;

  GraphicsDevice device() const { return device_; }
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
