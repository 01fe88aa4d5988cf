// SPDX-License-Identifier: Apache-2.0
// The first include is of what warp shows; the second, of what it keeps to itself, is not found.
#include "organbake/warp/warper.h"

#include "drawing/splat.h"

int main() {}
