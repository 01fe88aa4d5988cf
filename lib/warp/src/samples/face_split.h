// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/cutting/cut_organ.h"
#include "samples/sample_set.h"

namespace organbake {

// A camera's samples once faces of the shell are cut: each goes to the part of its face that it
// lies in. Chunks of whole faces keep their slots.
SampleSet split_samples(const SampleSet& set, const CutOrgan::FaceParts& parts);

}  // namespace organbake
