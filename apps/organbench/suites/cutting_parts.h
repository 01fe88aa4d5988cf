// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;

// Blades through a phantom, a liver and a laparoscopy's sheet: what comes out is sound.
void sweep_randomly(Bench& bench);
// How wide a bar opens that is cut half through, by the size of its tetrahedra.
void compare_openings(Bench& bench);

}  // namespace organbake
