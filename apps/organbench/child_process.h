// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

namespace organbake {

// A copy of this process that works on its own and tells what it found, so that a crash or a hang
// there costs no more than that work.
struct ChildProcess {
  pid_t process = 0;
  int fd = -1;  // to read what it writes, up to its end
};

// `work` gets what to write to; the child ends after it, and with this process. Call it before this
// process starts threads. Throws std::runtime_error.
ChildProcess start_child(const std::function<void(int fd)>& work);

// Whether anybody still reads.
bool write_line(int fd, std::string line);

// Waits for its end, after a signal if one is given; the status that waitpid tells.
int end_child(const ChildProcess& child, int signal = 0);

}  // namespace organbake
