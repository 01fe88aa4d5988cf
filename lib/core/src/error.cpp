// SPDX-License-Identifier: Apache-2.0
// What an exception means outside: the exit code that a program ends with, and one line for its
// user.
#include "organbake/core/error.h"

#include <new>

#include "organbake/core/text.h"

namespace organbake {

void require(bool holds, const std::string& name, double value, const char* advice) {
  if (!holds) throw UsageError(name + " = " + to_text(value) + ": " + advice);
}

ExitCode exit_code_for(const std::exception& error) {
  if (const auto* known = dynamic_cast<const Error*>(&error)) return known->code();
  if (dynamic_cast<const std::bad_alloc*>(&error)) return ExitCode::try_again;
  // A path that the system refuses us, met where nobody expected it.
  if (dynamic_cast<const std::filesystem::filesystem_error*>(&error)) return ExitCode::read_error;
  return ExitCode::internal;
}

std::string message_for(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error)) return "out of memory";
  if (const auto* of_file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
    return of_file->path1().string() + ": " + of_file->code().message();
  return error.what();
}

}  // namespace organbake
