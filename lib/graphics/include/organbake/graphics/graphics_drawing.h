// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "organbake/warp/organ_source.h"

namespace organbake {

// What draws in the context that is current.
struct GraphicsDevice {
  std::string name;       // as its driver calls it
  bool software = false;  // a processor that does as if
};
// Throws GraphicsError where no context is current, or it is older than OpenGL 3.3 and ES 3.0.
GraphicsDevice current_graphics_device();

// Draws organs with graphics hardware, in the words that OpenGL 3.3, OpenGL ES 3.0 and WebGL 2
// share. The processor's way (Warper, JointDrawing) is the reference, and each pass here follows
// one there:
//   place    a point for each patch of samples: where it lies, how large its splats are, whether
//            it is seen; kept in a buffer (transform feedback)
//   splat    each patch an instance, each sample a point: the nearest of a camera wins its pixel
//   base     the base layer's triangles where the cameras hardly see the skin or leave it open
//   resolve  the three cameras' layers and the base layer blended by depth and weight, and lit
//   finish   slits filled, instruments drawn, outlines smoothed
// What stays is uploaded once: the samples of a camera when a view first needs them, and of those
// what blades have changed; the posed shell, and how normals turn, whenever the organ has moved. A
// second eye finds all of it there.
//
// All calls, and the end, while the context that it was made in is current, which is left as a
// new one is: with no program, framebuffer or texture bound. One draw() at a time.
class GraphicsDrawing : public OrganDrawing {
 public:
  // Whether the first picture is held against the processor's.
  enum class FirstPicture { trusted, checked };
  static constexpr double kLeastAgreement_db = 40;
  // Where pictures go: read back into frames, or shown in the context's own framebuffer, such as
  // a page's canvas of the picture's size. Nothing waits for those; only a first one that is
  // checked is read back, too.
  enum class Pictures { read, shown };

  // Compiles the shaders for the current context. Throws GraphicsError with the driver's words.
  explicit GraphicsDrawing(FirstPicture first = FirstPicture::trusted,
                           Pictures pictures = Pictures::read);
  ~GraphicsDrawing() override;

  // Frames that keep what is bound are the processor's, and by OpenGL ES those that keep depth.
  std::string refusal(const std::vector<JointDrawing::Organ>& organs, const View& view,
                      const DrawOptions& options) const override;
  // Throws what JointDrawing does, and GraphicsError when the driver refuses: of a lost context,
  // for want of memory, or where a first picture that is checked agrees less than
  // kLeastAgreement_db. The organs are as they were, and the processor can draw them. Of the
  // report, counts of samples and faces are left out, and times are one: this thread's, waiting
  // included.
  DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options, Frame& frame) override;
  bool shows_pictures() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

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
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  // Whether it is a context now, and of hardware or not.
  std::optional<GraphicsDevice> open(void* display, bool embedded);
  void close();

  void *display_ = nullptr, *context_ = nullptr;  // EGL's
};

// Graphics hardware, or a driver that does as if, without a window: from its making to its end on
// one thread. (The context is the first base: it ends last.)
class OffscreenDrawing : private OffscreenContext, public GraphicsDrawing {};

}  // namespace organbake
