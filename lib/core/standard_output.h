// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace organbake {

// Writes a result and sees that it got there. Throws IoError when it didn't, for example
// because the disk behind it is full.
void write_to_stdout(std::string_view text);

}  // namespace organbake
