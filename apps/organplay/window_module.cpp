// SPDX-License-Identifier: Apache-2.0
#include "window_module.h"

#include <dlfcn.h>

#include <filesystem>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/truth/scope_lens.h"
#include "window/run_window.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

fs::path module_file() {
  return (program_folder() / ".." / "lib" / "organbake" / "organplay_window.so").lexically_normal();
}

}  // namespace

void open_window(const Command& command, const RunContext& context) {
  const fs::path file = module_file();
  constexpr const char* kWithout =
      "; without a window, give --script with --out, --view-deg with -o, --sheet, --compare or "
      "--bench";
  if (!fs::exists(file)) {
    throw UsageError("this organplay was built without its window (" + file.string() +
                     " is missing)" + kWithout);
  }
  // Never closed: OpenGL's drivers are not made to be unloaded, and the program ends soon.
  void* module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!module)
    throw UsageError(std::string("the window cannot be loaded: ") + ::dlerror() + kWithout);
  using Run = void (*)(const WindowCommand&, const RunContext&);
  const auto run = reinterpret_cast<Run>(::dlsym(module, "organplay_run_window"));
  if (!run) throw Error(ExitCode::internal, file.string() + " is not the window of organplay");
  WindowCommand window;
  window.bundles = command.bundles;
  window.solver = command.solver;
  window.light = command.light;
  window.drawn_by = command.drawn_by;
  window.eyes_mm = command.eyes_mm;
  if (!command.lens.empty()) window.scope = read_scope_lens(command.lens).picture;
  window.width = command.picture_size().width;
  window.height = command.picture_size().height;
  run(window, context);
}

}  // namespace organbake
