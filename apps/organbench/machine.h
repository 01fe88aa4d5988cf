// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace organbake {

// What a reader must know to compare figures: processor, cores, memory, compiler, versions of the
// libraries that do the work or compete.
std::vector<std::pair<std::string, std::string>> describe_machine();

}  // namespace organbake
