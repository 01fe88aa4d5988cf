// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "volume/volume.h"

namespace organbake {

// Throws BadDataError: "the mask has no label 7; it holds 1, 2, 5".
[[noreturn]] void throw_label_absent(const Volume& mask, int label);

}  // namespace organbake
