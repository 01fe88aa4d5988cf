// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bundle/bundle.h"
#include "core/run_context.h"

namespace organbake {

// A bundle as the player in a page reads it (bundle/bundle_pack.h), the same bytes for any number
// of threads. Throws BadDataError for a bundle too large for it, CancelledError.
std::vector<std::byte> web_pack(const Bundle& bundle, const RunContext& context = {});

// A gzip stream as small as is worth waiting for.
std::vector<std::byte> gzipped(std::span<const std::byte> bytes);

}  // namespace organbake
