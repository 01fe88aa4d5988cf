// SPDX-License-Identifier: Apache-2.0
#include "core/standard_output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/error.h"

namespace organbake {

void write_to_stdout(std::string_view text) {
  const bool taken = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!taken || std::fflush(stdout) != 0)
    throw IoError::writing("stdout", "cannot be written: " + std::string(std::strerror(errno)));
}

}  // namespace organbake
