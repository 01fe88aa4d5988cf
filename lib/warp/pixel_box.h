// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// Pixels x0 … x1−1 by y0 … y1−1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool empty() const { return x0 >= x1 || y0 >= y1; }
};

}  // namespace organbake
