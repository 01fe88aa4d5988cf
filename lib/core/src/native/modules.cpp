// SPDX-License-Identifier: Apache-2.0
// Where the program and its modules lie, and the way into a module. In, a module's name; out, the
// function that is its door.
#include <dlfcn.h>
#include <link.h>

#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace fs = std::filesystem;

fs::path program_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) throw IoError::reading("/proc/self/exe", error.message());
  return program.parent_path();
}

fs::path module_folder_above(const fs::path& code) {
  for (fs::path at = code.parent_path(); at.has_relative_path(); at = at.parent_path())
    if (const fs::path modules = at / "lib" / "organbake"; fs::is_directory(modules))
      return modules;
  return (code.parent_path() / ".." / "lib" / "organbake").lexically_normal();
}

fs::path module_folder() {
  Dl_info place{};
  link_map* of = nullptr;
  // A program's own name in that list is empty.
  const auto here = reinterpret_cast<void*>(&module_folder);
  const bool found = ::dladdr1(here, &place, reinterpret_cast<void**>(&of), RTLD_DL_LINKMAP) != 0;
  return found && of && *of->l_name
             ? module_folder_above(fs::absolute(of->l_name).lexically_normal())
             : module_folder_above(program_folder() / "program");
}

std::vector<fs::path> loaded_modules() {
  std::vector<fs::path> files;
  const auto add = [](dl_phdr_info* library, std::size_t, void* list) {
    static_cast<std::vector<fs::path>*>(list)->emplace_back(library->dlpi_name);
    return 0;
  };
  ::dl_iterate_phdr(add, &files);
  std::erase_if(files, [modules = module_folder()](const fs::path& file) {
    return file.parent_path() != modules;
  });
  return files;
}

void* module_door(const std::string& name, const char* door) {
  const fs::path file = module_folder() / (name + ".so");
  const auto incomplete = [&](const std::string& why) {
    return Error(ExitCode::internal,
                 file.string() + ": " + why + "; the installation is incomplete");
  };
  void* const module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!module) {
    const std::string why = std::string("cannot be loaded: ") + ::dlerror();
    // A library that is missing, or of another version, is missing from the installation; that one
    // cannot be read is the system's fault.
    for (const char* sign : {"No such file", "undefined symbol", "version `"})
      if (why.find(sign) != why.npos) throw incomplete(why);
    throw IoError::reading(file, why);
  }
  void* const found = ::dlsym(module, door);
  if (!found) throw incomplete("is no module of this program");
  return found;
}

}  // namespace organbake
