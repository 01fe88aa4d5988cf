// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace organbake {

// Grows what is known of an image of width × height pixels by `rings` rings: of each pixel that
// lies beside known ones (left, right, above, below), mix(pixel, their numbers) makes it known,
// too. The order of pixels has no say in the result: a ring takes its colours from the rings before
// it.
template <class Mix>
void grow(int width, int height, int rings, std::vector<std::uint8_t>& known, const Mix& mix) {
  std::vector<std::size_t> ring;
  for (int r = 0; r < rings; ++r) {
    ring.clear();
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t i = std::size_t(y) * width + x;
        if (known[i]) continue;
        std::size_t beside[4];
        std::size_t count = 0;
        const auto look = [&](bool inside, std::size_t j) {
          if (inside && known[j]) beside[count++] = j;
        };
        look(x > 0, i - 1), look(x + 1 < width, i + 1);
        look(y > 0, i - width), look(y + 1 < height, i + width);
        if (count == 0) continue;
        mix(i, std::span<const std::size_t>(beside, count));
        ring.push_back(i);
      }
    if (ring.empty()) return;
    for (const std::size_t i : ring) known[i] = 1;
  }
}

}  // namespace organbake
