// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/instruments/instrument.h"
#include "organbake/player/embedded_player.h"

namespace organbake {

// The instruments that an embedding program's, or Python's, tips stand for. Throws UsageError
// naming the tip that does more than one thing.
std::vector<Instrument> instruments_from(const std::vector<EmbeddedPlayer::Tip>& tips);

}  // namespace organbake
