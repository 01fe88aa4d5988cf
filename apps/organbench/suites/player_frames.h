// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;
class PlayerBundles;

// A frame's time against its error, beside Embree and Mesa's llvmpipe; threads.
void promise_frames(Bench& bench, PlayerBundles& bundles);

}  // namespace organbake
