// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/truth/cavity_wall.h"
#include "organbake/truth/flow.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/truth/scope_lens.h"
#include "organbake/warp/draw_options.h"

namespace organbake {

// Pictures as a scope shows them, made of pictures of a pinhole in its place that is wide enough to
// hold all that the scope sees, and up to twice as fine. Where a ray of the scope meets the
// pinhole's picture is worked out once for all frames.
class LensPicture {
 public:
  // Throws BadDataError naming `name` for a lens that folds its picture over itself, and for one
  // that sees too wide for a pinhole.
  LensPicture(const ScopeLens& lens, const std::string& name);

  const Intrinsics& lens() const { return scope_.intrinsics; }  // of the pictures that come out
  const Intrinsics& pinhole() const { return pinhole_; }        // of those that are to be drawn
  // Asks for what show(DrawnScene) needs of a frame. Layers of truth do not depend on it.
  void prepare(DrawOptions& options) const;

  // Blended between four pixels, in linear light, weakened by the vignette, and made what the
  // scope's camera makes of it.
  void show(const Rgb8Image& drawn, Rgb8Image& seen) const;
  // The same of a frame that was drawn as prepare() asks, with what lies behind the organs and what
  // is out of focus, where the scope's picture has them.
  void show(const DrawnScene& scene, Rgb8Image& seen) const;
  // What each ray meets: of the four pixels round it the part that fills most of them, with planar
  // depth, normals and skin points between those that show it, as exact as these are. Points are
  // not told.
  void show(const PixelTruth& drawn, PixelTruth& seen) const;
  // In pixels of the scope's pictures; `drawn` is that of the pinhole's picture `truth`.
  void show(const Flow& drawn, const PixelTruth& truth, Flow& seen) const;

 private:
  void resample(const Rgb8Image& drawn, Rgb8Image& seen) const;
  std::vector<float> depth_seen(const std::vector<float>& drawn_mm) const;
  // The pixels round a ray that show what it meets, and their shares.
  struct Corners;
  Corners corners(std::size_t pixel, const PixelTruth& drawn) const;
  Eigen::Vector2f through_lens(const Eigen::Vector2f& pinhole_px) const;

  ScopeLens scope_;
  Intrinsics pinhole_;
  std::vector<Eigen::Vector2f> at_px_;  // of each of the scope's pixels, in the pinhole's picture
  std::vector<float> gain_;             // of each; empty without a vignette
};

}  // namespace organbake
