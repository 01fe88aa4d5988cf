// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;

// The shared video against COLMAP's model of it, and colmap itself where it is installed.
void promise_motion_of_video(Bench& bench);

}  // namespace organbake
