// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <optional>

#include "actions.h"
#include "command.h"
#include "organbake/core/error.h"
#include "organbake/core/heap.h"
#include "organbake/core/parallel.h"
#include "stop_signal.h"

namespace organbake {
namespace {

RunContext context_for(const Command& command, const std::atomic<bool>& stop_asked) {
  const auto log = [flags = command.shared](LogLevel level, std::string_view message) {
    if (flags.quiet && level != LogLevel::warning) return;
    if (!flags.verbose && level == LogLevel::debug) return;
    std::fprintf(stderr, "organplay: %s%.*s\n", level == LogLevel::warning ? "warning: " : "",
                 static_cast<int>(message.size()), message.data());
  };
  return {log, {}, &stop_asked};
}

int run(int argc, char** argv) {
  const std::atomic<bool>& stop_asked = catch_stop_signals();
  try {
    const std::optional<Command> command = read_command(argc, argv);
    if (!command) return 0;
    std::optional<ThreadLimit> threads;
    if (command->shared.threads > 0) threads.emplace(command->shared.threads);
    const RunContext context = context_for(*command, stop_asked);
    for (const std::string& note : command->notes) context.info(note);
    run_command(*command, context);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "organplay: error: %s\n", message_for(error).c_str());
    return static_cast<int>(exit_code_for(error));
  }
}

}  // namespace
}  // namespace organbake

int main(int argc, char** argv) {
  organbake::keep_heap_in_large_pages();
  return organbake::run(argc, argv);
}
