// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/player/comparison_table.h"
#include "suites/player_bundles.h"

// The player's suite, by what it measures.
namespace organbake {

// The views of the paper's Table 1; fewer and smaller ones in a quick run.
CompareOptions paper_table(const Bench& bench);
// The paper's Table 1, pictures against the truth, a sweep over the VPM.
void promise_accuracy(Bench& bench, PlayerBundles& bundles);
// Our rows beside the paper's, at rest and poked.
void rebuild_paper_table(Bench& bench, const ComparisonTable& fitted, const ComparisonTable& naive);
// What pictures gain by more faces, lose where the tissue is another, and show beyond a mesh that
// Mesa's llvmpipe draws.
void compare_pictures(Bench& bench, PlayerBundles& bundles);
// Outlines of lobes before other skin, against the truth.
void promise_inner_outlines(Bench& bench);
// The worst poked view: truth, frame, errors.
void show_worst_poke(Bench& bench, PlayerBundles& bundles);
// A frame's time against its error, beside Embree and Mesa's llvmpipe; threads.
void promise_frames(Bench& bench, PlayerBundles& bundles);
// Frames in which skin moves: all of it, a tenth, none; lit anew.
void promise_motion(Bench& bench, PlayerBundles& bundles);
// What a smooth skin makes of dents that its proxy's vertices know at their own places alone.
void promise_dents(Bench& bench);
// The deformation's step at three sizes of proxy.
void promise_deformation(Bench& bench);
// Static shapes under dead loads: the finite elements' against their own converged ones, the
// springs' against linear finite elements'.
void promise_statics(Bench& bench, const TriangleMesh& organ);
// A picture with depth, flow and mask beside it, on one core.
void promise_truth(Bench& bench, PlayerBundles& bundles);
// A cold organplay: time to its first frame, memory, size.
void promise_program(Bench& bench, PlayerBundles& bundles);

}  // namespace organbake
