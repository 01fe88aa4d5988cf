// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/cutting/cut_skin.h"

namespace organbake {

// Moves the lips of cuts from which blades took tissue away apart, each by half the cut's width,
// and the skin beside them less and less. `vertices` are those of the skin.
void draw_skin_back(const CutSkin& skin, const CutSheet& sheet,
                    std::vector<CutSkin::Vertex>& vertices);

}  // namespace organbake
