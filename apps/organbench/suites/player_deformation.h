// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;

// The deformation's step: its iterations against its error, three sizes of proxy; the bake of the
// skin that follows it.
void promise_deformation(Bench& bench);

}  // namespace organbake
