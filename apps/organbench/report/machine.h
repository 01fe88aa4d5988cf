// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

namespace organbake {

// What a reader must know to compare figures: processor, cores, memory, compiler, versions of the
// libraries that do the work or compete.
std::map<std::string, std::string> describe_machine();

}  // namespace organbake
