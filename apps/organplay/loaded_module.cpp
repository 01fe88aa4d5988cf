// SPDX-License-Identifier: Apache-2.0
#include "loaded_module.h"

#include <dlfcn.h>

#include <filesystem>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {

void* load_door(const LoadedModule& module, const char* door) {
  const std::filesystem::path file =
      (program_folder() / ".." / "lib" / "organbake" / module.file).lexically_normal();
  const std::string instead = "; " + module.instead;
  if (!std::filesystem::exists(file))
    throw UsageError("this organplay was built without " + module.missing + " (" + file.string() +
                     " is missing)" + instead);
  void* const loaded = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!loaded) throw UsageError(module.failed + ": " + ::dlerror() + instead);
  void* const found = ::dlsym(loaded, door);
  if (!found) throw Error(ExitCode::internal, file.string() + " is not a module of organplay");
  return found;
}

}  // namespace organbake
