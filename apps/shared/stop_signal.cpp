// SPDX-License-Identifier: Apache-2.0
#include "stop_signal.h"

#include <signal.h>
#include <unistd.h>

#include "organbake/core/error.h"

namespace organbake {
namespace {

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

void on_signal(int) {
  if (stop_asked.exchange(true)) ::_exit(int(ExitCode::interrupted));
}

// Never a reason to end at once: one may come from the terminal and another from its shell.
void on_hangup(int) { stop_asked = true; }

bool is_ignored(int signal) {
  struct sigaction now {};
  return ::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

}  // namespace

const std::atomic<bool>& catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // A closed terminal; nohup has it ignored, and that is to stay.
  action.sa_handler = on_hangup;
  if (!is_ignored(SIGHUP)) ::sigaction(SIGHUP, &action, nullptr);
  // A file that may not grow any more is a full disk like any other: an error, not a signal.
  ::signal(SIGXFSZ, SIG_IGN);
  return stop_asked;
}

}  // namespace organbake
