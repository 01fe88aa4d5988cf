// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace organbake {

// A context of OpenGL without a window or a display, by EGL: current from its making to its end, on
// the thread that made it.
class OffscreenContext {
 public:
  enum class Kind { desktop, embedded };  // OpenGL 3.3 core; OpenGL ES 3.0

  // Of real graphics hardware where there is any, else of a software one. Throws GraphicsError
  // where EGL or a driver is missing.
  explicit OffscreenContext(Kind kind = Kind::desktop);
  ~OffscreenContext();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
