// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "organbake/player/player.h"
#include "organbake/truth/lens_picture.h"

namespace organbake {

// What is written of a drawn frame: the frame as it is or as a scope's lens shows it, and beside
// it, where two eyes are asked for, the picture of the right one.
class ShownPicture {
 public:
  ShownPicture(Player& player, std::shared_ptr<const LensPicture> lens,
               std::optional<double> eyes_mm);

  // Pixels that it is wide, of a view that is `width`.
  int width_of(int width) const { return eyes_mm_ ? 2 * width : width; }
  // Until the next one. `options` are the frame's, its tools among them.
  const Rgb8Image& of(const Frame& frame, const View& view, const DrawOptions& options);

 private:
  const Rgb8Image& through_lens(const Frame& frame, const View& view, Rgb8Image& seen) const;

  Player& player_;
  std::shared_ptr<const LensPicture> lens_;
  std::optional<double> eyes_mm_;
  Bounds organs_;  // at rest
  Frame right_frame_;
  Rgb8Image left_, right_, both_;
};

}  // namespace organbake
