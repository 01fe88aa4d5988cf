// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

#include "organbake/player/player.h"
#include "organbake/player/state_reader.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// States of one organ, one after the other, x y z of each point in world mm.
struct StateBatch {
  std::variant<std::span<const float>, std::span<const double>> xyz_mm;
  std::size_t count = 0;
  StateOf of = StateOf::vertices;
};

// Room for the pictures and their layers, one after the other, each top row first; a null pointer
// for what is not wanted.
struct BatchPlanes {
  std::uint8_t* rgb = nullptr;        // 8-bit sRGB
  float* depth_mm = nullptr;          // planar z, +inf at the background
  float* normals = nullptr;           // x y z: camera axes, unit, towards the eye; 0: background
  std::uint8_t* mask = nullptr;       // 0 background, 1 organ
  float* flow_back = nullptr;         // x y: to the picture before it; 0 of the first
  std::uint8_t* flow_seen = nullptr;  // whether that picture shows the point as well; with the flow
};

// Draws many states of one of a player's organs, alone, at once, a thread for each, from one copy
// of its samples: the very pictures and layers that setting and drawing one after the other gives.
class BatchDrawing {
 public:
  // The player must outlive it, and not be moved. Throws UsageError for an organ that is not there
  // or that blades have cut.
  explicit BatchDrawing(const Player& player, std::size_t organ = 0);
  ~BatchDrawing();

  // views: one for all, or one for each state; all of one size. Throws UsageError for what is not
  // so, what StateReader throws, beginning with which state, and what Player::draw() throws.
  void draw(const StateBatch& states, std::span<const View> views, DrawnLight light,
            const BatchPlanes& planes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
