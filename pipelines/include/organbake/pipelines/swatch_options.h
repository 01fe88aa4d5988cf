// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

// Of the sheet of materials that the module `swatches` draws.
struct SwatchOptions {
  int columns = 3;
  int side_px = 320;  // of one swatch
};

inline constexpr const char* kSwatchFile = "swatches.png";

}  // namespace organbake
