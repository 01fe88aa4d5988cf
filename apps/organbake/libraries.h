// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

namespace organbake {

// A stage's module that cannot be loaded, in the loader's words.
struct UnloadableModule {
  std::string file, reason;
};

// Loads the modules of all stages, which takes a good part of a second.
std::vector<UnloadableModule> unloadable_modules();

// The versions of the libraries that organbake works with: of the stages' by the files that are
// loaded now, so of all after unloadable_modules(); of the others, and of those that are headers
// alone, as they were when organbake was built.
std::map<std::string, std::string> library_versions();

}  // namespace organbake
