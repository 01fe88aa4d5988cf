// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "bench.h"

namespace organbake {

// An organ of the shared CT, baked in a material by name; empty, and said in the result, when the
// CT is not there.
std::filesystem::path material_bundle(Bench& bench, const std::string& organ,
                                      const std::string& material);

}  // namespace organbake
