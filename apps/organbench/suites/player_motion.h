// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;
class PlayerBundles;

// Frames in which skin moves: all of it, a tenth, none; lit anew.
void promise_motion(Bench& bench, PlayerBundles& bundles);

}  // namespace organbake
