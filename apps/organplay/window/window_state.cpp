// SPDX-License-Identifier: Apache-2.0
#include "window/window_state.h"

namespace organbake {

void WindowState::choose(const InstrumentKind& chosen, const Player& player) {
  if (has_blade(chosen) && !player.can_cut()) {
    message = player.bundle().mechanics.body
                  ? "Springs cannot be cut: choose finite elements below."
                  : "Springs cannot be cut: bake the organ with tetrahedra.";
    return;
  }
  kind = kind == chosen ? InstrumentKind(Ball{}) : chosen;
}

void WindowState::restart(LiveSession& session) {
  session.reset();
  largest_force_n = 0;
}

}  // namespace organbake
