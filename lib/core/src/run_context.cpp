// SPDX-License-Identifier: Apache-2.0
// How a long computation speaks to whoever runs it: a second listener to its messages, and the way
// out when it is cancelled.
#include "organbake/core/run_context.h"

#include "organbake/core/error.h"

namespace organbake {

RunContext RunContext::heard_by(Log listener) const {
  RunContext heard = *this;
  heard.log_ = [listener = std::move(listener), log = log_](LogLevel level, std::string_view text) {
    listener(level, text);
    if (log) log(level, text);
  };
  return heard;
}

void RunContext::throw_if_cancelled() const {
  if (cancelled()) throw CancelledError();
}

}  // namespace organbake
