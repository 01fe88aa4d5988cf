// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"

#include <new>

namespace organbake {

ExitCode exit_code_for(const std::exception& error) {
  if (const auto* known = dynamic_cast<const Error*>(&error)) return known->code();
  if (dynamic_cast<const std::bad_alloc*>(&error)) return ExitCode::try_again;
  return ExitCode::internal;
}

}  // namespace organbake
