// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/options/options.h"
#include "organbake/volume/read_volume.h"

namespace organbake {

// How a volume is read, as flags and recipe keys have it.
struct ReadStageOptions {
  std::string series;
  bool strict = false;
  std::string roi;  // as parse_region reads it; empty = all
  int time = 0;     // of several time points, from 1
  UnitAffine unit_affine = UnitAffine::refuse;

  // Inline, so that only the stages' modules need what parses a region.
  VolumeReadOptions resolved() const {
    VolumeReadOptions options{
        .series = series, .strict = strict, .time = time, .unit_affine = unit_affine};
    if (!roi.empty()) options.region = parse_region(roi, "--roi-mm");
    return options;
  }
};

void bind(OptionList& list, ReadStageOptions& options);

}  // namespace organbake
