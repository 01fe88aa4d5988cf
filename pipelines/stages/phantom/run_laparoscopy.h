// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/pipelines/stage_module.h"
#include "stages/phantom/options.h"

namespace organbake {

// A scope that sways over a bed of bumps: frames/ is what `shade` reads, right/ and stereo.json
// what `stereo` reads besides; truth/ what they should find.
StageReport run_laparoscopy(const PhantomStageOptions& options, const StageCall& call);

}  // namespace organbake
