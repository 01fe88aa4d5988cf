// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace organbake {

// What a set of cameras must do: at least `samples` samples seen by at least `overlap` of them.
struct CoverGoal {
  std::size_t samples = 0;
  int overlap = 2;
};

}  // namespace organbake
