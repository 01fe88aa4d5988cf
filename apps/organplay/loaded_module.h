// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace organbake {

// A part of organplay that most runs have no use for, and that lies beside the program as
// ../lib/organbake/<file>: the window, drawing by graphics hardware, the comparison, YAML.
struct LoadedModule {
  std::string file;
  std::string missing;  // "this organplay was built without <missing>"
  std::string failed;   // "<failed>: what the loader says"
  std::string instead;  // what to do without it
};

// Loads the module until the program ends, for OpenGL's drivers are not made to be unloaded, and
// returns its function `door`. Throws UsageError where it was not built or cannot be loaded.
void* load_door(const LoadedModule& module, const char* door);

}  // namespace organbake
