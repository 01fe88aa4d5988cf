// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// What makes the pictures. By itself graphics hardware makes those of a window that has it, and the
// processor all others.
enum class DrawnBy { automatic, processor, graphics };

}  // namespace organbake
