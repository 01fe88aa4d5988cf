// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/pipelines/stage.h"

namespace organbake {

// A stage as 3D Slicer's execution model describes a command-line module (XML): inputs and the
// output as Slicer's own nodes where it has any, else as files, and every option with its range and
// default. Options are passed by their long flags.
std::string slicer_module(const Stage& stage, const OptionList& options);

}  // namespace organbake
