// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organ_passes.h"
#include "organbake/warp/frame.h"

namespace organbake {

// Brings finished pictures from the graphics hardware's memory into frames.
class ReadBack {
 public:
  // The frame's colour and cover, and its depth where `options` keep it; counts covered pixels.
  void read(const OrganPasses& passes, const Targets::Picture& picture, const DrawOptions& options,
            Frame& frame, DrawReport& report);

 private:
  std::vector<std::uint8_t> pixels_;
};

}  // namespace organbake
