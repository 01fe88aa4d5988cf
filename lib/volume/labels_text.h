// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "volume/volume.h"

namespace organbake {

// "1 spleen, 5 liver": what messages can name without filling the screen.
std::string label_list(const std::vector<LabelName>& names);

// Throws BadDataError: "the mask has no label 7; it holds 1 spleen, 2, 5".
[[noreturn]] void throw_label_absent(const Volume& mask, int label);

}  // namespace organbake
