// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "support/synthetic_bundle.h"

namespace organbake {

// A short script for organ_to_play(): the eye goes round while a probe presses where the organ
// faces camera 0.
Script short_script(double depth_mm);

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
