// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/isosurface/isosurface.h"
#include "organbake/options/options.h"
#include "stages/shared/reading_options.h"

namespace organbake {

struct IsosurfaceStageOptions {
  IsosurfaceOptions surface;
  std::string label = "1";  // number, name, or several of them
  bool each_label = false;  // a file for every label of the mask, in a folder
  ReadStageOptions reading;
};

void bind(OptionList& list, IsosurfaceStageOptions& options);

}  // namespace organbake
