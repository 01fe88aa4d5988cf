// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/cutting/cut_organ.h"
#include "samples/sample_set.h"

namespace organbake {

// Gives a camera's samples, once faces of the shell are cut, each to the part of its face that it
// lies in. Chunks of whole faces keep their slots.
void split_samples(const CutOrgan::FaceParts& parts, SampleSet& set);

}  // namespace organbake
