// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/phantom/scope_path.h"

namespace organbake {

struct MovingClipOptions {
  // Its seed, size, frames, noise, highlights, instrument, light; texture is the standard deviation
  // of the albedo. A second eye, a tilt and two tissues belong to LaparoscopyPhantom.
  LaparoscopyOptions view;
  ScopePath path = ScopePath::tour;
  double breathing_mm = 0;        // how far a breath pushes the liver, 0…20
  double breathing_period_s = 4;  // 1…20
  double blurred = 0;             // share 0…1 of the frames that a jerk of the scope blurs

  void check() const;  // throws UsageError
};

// A clip of a scope that moves over a liver, a gallbladder and fat which reach farther than one
// frame shows, lit by a lamp at the lens whose mirror reflections move with it. What the tissue is
// like suits structure from motion as real tissue does: TissueRelief, TissueSkin.
//   Breathing pushes it by excursion · sin⁴(π t / period) (Lujan et al. 1999): long rests, short
// breaths. It is not the same everywhere, so no motion of the scope explains it. A jerk turns the
// scope by 6 to 18 px (of a width of 1280) while a frame is taken. A steel shaft of 5 mm crosses in
// the middle of the clip. The exposure follows the tissue's distance, as a scope's does.
class MovingClip {
 public:
  static constexpr double kFramesPerSecond = 25;

  explicit MovingClip(const MovingClipOptions& options);
  ~MovingClip();
  MovingClip(MovingClip&&) noexcept;

  // Of one frame; the camera is named after it, frame_000012. World: that of the tissue at rest.
  PosedCamera camera(int frame) const;
  double time_s(int frame) const { return frame / kFramesPerSecond; }
  double breath_mm(int frame) const;
  double blur_px(int frame) const;  // length of the trail that the middle of the picture leaves
  LaparoscopyFrame frame(int index, const RunContext& context = {}) const;

  // The tissue at rest, whole, with its albedo as colours.
  TriangleMesh surface() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace organbake
