// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organ_to_play.h"
#include "organbake/player/player.h"

namespace organbake {

// The organ to play, of tetrahedra of 15 mm, held on one side of where it will be cut.
const Bundle& organ_to_cut();
DeformOptions with_fem();

// A blade through the whole organ beside its middle, from far to near, edge upright.
Instrument blade_at(double share);
// What was swept parts a few steps later, and then what was swept meanwhile.
void let_part(Player& player);
// That blade, all the way.
Script cutting_script();
// Of all frames' pictures.
std::vector<std::uint8_t> bytes_of(Player& player, const Script& script);

}  // namespace organbake
