// SPDX-License-Identifier: Apache-2.0
#include "read_back.h"

#include <limits>

#include "opengl.h"

namespace organbake {

void ReadBack::read(const OrganPasses& passes, const Targets::Picture& picture,
                    const DrawOptions& options, Frame& frame, DrawReport& report) {
  const int width = passes.targets().width, height = passes.targets().height;
  const std::size_t count = std::size_t(width) * height;
  frame.serial = 0;
  frame.color.width = width, frame.color.height = height;
  frame.color.pixels.resize(3 * count);
  frame.cover.resize(count);
  frame.depth_mm.resize(options.keep_depth ? count : 0);
  frame.shown.clear(), frame.bound.clear(), frame.organ.clear();
  pixels_.resize(4 * count);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer.name());
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) frame.color.pixels[3 * i + c] = pixels_[4 * i + c];
    frame.cover[i] = static_cast<Cover>(pixels_[4 * i + 3]);
    report.sample_pixels += frame.cover[i] == Cover::samples;
    report.base_pixels += frame.cover[i] == Cover::base;
  }
  if (!options.keep_depth) return;
  glReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, frame.depth_mm.data());
  for (float& depth : frame.depth_mm)
    depth = depth < 1 ? depth * passes.reach_mm() : std::numeric_limits<float>::infinity();
}

}  // namespace organbake
