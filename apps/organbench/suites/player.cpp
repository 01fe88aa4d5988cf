// SPDX-License-Identifier: GPL-3.0-or-later
#include "suites.h"
#include "suites/player_parts.h"

namespace organbake {

void run_player_suite(Bench& bench) {
  promise_deformation(bench);
  promise_dents(bench);
  PlayerBundles bundles(bench);
  promise_accuracy(bench, bundles);
  compare_pictures(bench, bundles);
  promise_inner_outlines(bench);
  show_worst_poke(bench, bundles);
  promise_frames(bench, bundles);
  promise_motion(bench, bundles);
  promise_truth(bench, bundles);
  promise_program(bench, bundles);
}

}  // namespace organbake
