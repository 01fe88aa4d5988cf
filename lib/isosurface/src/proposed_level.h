// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/volume/volume.h"

namespace organbake {

struct ProposedLevel {
  double level_hu = 0;
  double low_peak_hu = 0, high_peak_hu = 0;  // the commonest values of the two classes

  std::string reason() const;  // "half-way between the peaks at −1000 and 60"
};

// Splits the histogram in two classes (Otsu 1979) and goes half-way between their peaks: where a
// voxel is half one and half the other. In a CT with air around the patient that is the skin, or
// the one organ of a phantom. Throws BadDataError when all voxels have one value.
ProposedLevel propose_level(const Volume& ct);

}  // namespace organbake
