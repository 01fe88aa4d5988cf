// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/heap.h"
#include "organbake/core/parallel.h"
#include "organplay.h"
#include "stop_signal.h"
#include "terminal.h"

namespace organbake {
namespace {

int run(int argc, char** argv) {
  const std::atomic<bool>& stop_asked = catch_stop_signals();
  Terminal terminal("organplay");
  try {
    const std::optional<Command> command = read_command(argc, argv);
    if (!command) return 0;
    std::optional<ThreadLimit> threads;
    if (command->shared.threads > 0) threads.emplace(command->shared.threads);
    terminal.obey(command->shared);
    for (const std::string& note : command->notes) terminal.log(LogLevel::info, note);
    run_command(*command,
                [&](const std::string& task) { return terminal.context(task, &stop_asked); });
    return 0;
  } catch (const std::exception& error) {
    terminal.error(message_for(error));
    return static_cast<int>(exit_code_for(error));
  }
}

}  // namespace
}  // namespace organbake

int main(int argc, char** argv) {
  organbake::keep_heap_in_large_pages();
  return organbake::run(argc, argv);
}
