// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

// Geman & McClure 1987: the weight of a residual whose square is `off2` times that of the cutoff. 1
// for what fits, a quarter at the cutoff, nothing far beyond.
inline double robust_weight(double off2) { return 1 / ((1 + off2) * (1 + off2)); }

}  // namespace organbake
