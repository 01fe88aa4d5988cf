// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "organbake/player/player.h"
#include "organbake/truth/flow.h"
#include "organbake/truth/layer_set.h"
#include "organbake/truth/moment.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// The truth beside the pictures of one eye, one after the other.
class TruthTracker {
 public:
  explicit TruthTracker(const LayerSet& layers) : layers_(layers) {}

  // The picture that the player drew last, with DrawOptions::keep_bound; its bound pixels are taken
  // out of it. tools: those that were drawn.
  void advance(const Player& player, const View& view, const std::vector<Solid>& tools,
               Frame& picture);
  // The same of organs that are drawn without a player, uncut.
  void advance(const std::vector<DrawnOrgan>& organs, const View& view,
               const std::vector<Solid>& tools, Frame& picture);
  void forget() { pictures_ = 0; }

  const LayerSet& layers() const { return layers_; }
  const PixelTruth& now() const { return truths_[pictures_ % 2]; }
  const Moment& moment() const { return moments_[pictures_ % 2]; }
  // Of the picture before; nothing at the first, and where flow is not asked for.
  bool has_before() const { return pictures_ > 1; }
  const PixelTruth& before() const { return truths_[(pictures_ + 1) % 2]; }
  const Moment& moment_before() const { return moments_[(pictures_ + 1) % 2]; }

  void find_backward(Flow& flow) const {  // from now to before
    find_flow(now(), moment(), before(), moment_before(), flow);
  }
  void find_forward(Flow& flow) const {  // from before to now
    find_flow(before(), moment_before(), now(), moment(), flow);
  }

 private:
  LayerSet layers_;
  std::size_t pictures_ = 0;
  std::array<PixelTruth, 2> truths_;
  std::array<Moment, 2> moments_;
};

}  // namespace organbake
