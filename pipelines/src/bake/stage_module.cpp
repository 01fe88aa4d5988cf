// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/stage_module.h"

#include <dlfcn.h>

#include <string_view>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw Error(ExitCode::internal, file.string() + ": " + why + "; the installation is incomplete");
}

// A library that is missing, or of another version, is missing from the installation; that one
// cannot be read is the system's fault.
[[noreturn]] void refuse_unloaded(const fs::path& file, const std::string& why) {
  for (const char* sign : {"No such file", "undefined symbol", "version `"}) {
    if (why.find(sign) != std::string::npos) refuse(file, "cannot be loaded: " + why);
  }
  throw IoError::reading(file, "cannot be loaded: " + why);
}

template <class Function>
Function symbol(void* module, const char* name, const fs::path& file) {
  void* address = ::dlsym(module, name);
  if (!address) refuse(file, "is not a module of organbake");
  return reinterpret_cast<Function>(address);
}

}  // namespace

fs::path module_folder() {
  return (program_folder() / ".." / "lib" / "organbake").lexically_normal();
}

fs::path module_file(const std::string& stage) {
  return module_folder() / ("stage_" + stage + ".so");
}

StageReport run_in_module(const Stage& stage, const StageCall& call) {
  const fs::path file = module_file(stage.name);
  // Never closed: the libraries behind it are not made to be unloaded, and the program ends soon.
  void* module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!module) refuse_unloaded(file, ::dlerror());
  const auto version = symbol<const char* (*)()>(module, "organbake_stage_version", file);
  if (std::string_view(version()) != kVersion) {
    refuse(file, std::string("is of version ") + version() + ", not " + kVersion);
  }
  const auto run =
      symbol<void (*)(const StageCall&, StageReport&)>(module, "organbake_stage_run", file);
  StageReport report;
  run(call, report);
  return report;
}

}  // namespace organbake
