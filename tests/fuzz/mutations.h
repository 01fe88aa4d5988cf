// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fuzz/readers.h"
#include "organbake/core/random.h"

namespace organbake {

// One of the seeds made worse by one to four changes: bits flipped, counts and lengths overwritten
// by those that programs trip over, numbers in text replaced, pieces cut out, doubled, or put in
// from other seeds, words of the format put in. The same stream gives the same bytes.
std::string damaged_seed(const Seeds& seeds, const Words& words, RandomStream& random);

}  // namespace organbake
