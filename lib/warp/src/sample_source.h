// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/warp/organ_source.h"
#include "samples/sample_set.h"

namespace organbake {

SampleSource source_of(const SampleSet& set);

}  // namespace organbake
