// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

// What of the pictures is correlated.
enum class Similarity {
  radiance,    // the paper's NCC
  gradient,    // of their slopes by x and y: blind to what varies slowly, such as vignetting
  silhouette,  // of the surface's cover with what has the organ's colours; needs a start
};

// Whether one correlation stands for the picture, or one per patch with a robust loss on 1 − R_k:
// patches shrug off vignetting, albedo and instruments.
enum class SimilarityWindow { whole, patches };

}  // namespace organbake
