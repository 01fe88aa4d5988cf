// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/cutting/wet_rim.h"
#include "samples/sample_set.h"

namespace organbake {

// Dims those of the uncut organ's samples that lie under the film of blood along the lips of cuts.
// skin: the uncut organ's, at rest.
void wet_samples(const TriangleMesh& skin, const WetRim& rim, SampleSet& samples);

}  // namespace organbake
