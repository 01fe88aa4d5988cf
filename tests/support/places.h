// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace organbake {

// What lies below the clone that was built, and below the folder of real data beside it; tests that
// need the latter are skipped, loudly, where it is missing. One file alone has been told where
// these are: all others are the same in any clone, so that clones share what is compiled.
std::filesystem::path in_clone(const std::filesystem::path& below);
std::filesystem::path shared_data(const std::filesystem::path& below);

}  // namespace organbake
