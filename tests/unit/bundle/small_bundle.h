// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "bundle/bundle.h"

namespace organbake {

// A whole, valid bundle of two 8×6 cameras round a tetrahedron.
Bundle small_bundle();
void write_bundle(const std::filesystem::path& folder, const Bundle& bundle);

}  // namespace organbake
