// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "window/display.h"

namespace organbake {

// Escape asks whether to leave, and once more or "stay" goes back. `unsaved`: something would be
// lost.
class LeaveQuestion {
 public:
  void show(Display& display, bool unsaved);

 private:
  bool asked_ = false;
};

}  // namespace organbake
