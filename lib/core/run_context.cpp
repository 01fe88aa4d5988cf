// SPDX-License-Identifier: Apache-2.0
#include "core/run_context.h"

#include "core/error.h"

namespace organbake {

void RunContext::throw_if_cancelled() const {
  if (cancelled()) throw CancelledError();
}

}  // namespace organbake
