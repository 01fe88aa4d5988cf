// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>

namespace organbake {

// What C++ throws, as Python's own: ValueError for what was asked or what a file holds, OSError for
// files that are not there or cannot be used, with the programs' sentences.
void translate_error(std::exception_ptr thrown);

}  // namespace organbake
