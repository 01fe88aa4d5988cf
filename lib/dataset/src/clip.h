// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "organbake/bundle/bundle.h"
#include "organbake/dataset/dataset_spec.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/script.h"

namespace organbake {

// A piece of a data set: what happens, and how its pictures are exposed.
struct DatasetClip {
  Script script;
  double gain = 1, noise = 0;
};

// The clip of an organ, by both numbers and the spec's seed alone. Pokes come from directions in
// which the organ has skin; where none is found, a clip has fewer.
DatasetClip make_clip(const DatasetSpec& spec, const Bundle& bundle, std::size_t organ, int number);

// Gain in linear light, then Gaussian noise in the 8-bit values; nothing at 1 and 0. `item` names
// the picture among all that have the seed.
void expose(double gain, double noise, std::uint64_t seed, std::uint64_t item, Rgb8Image& picture);

}  // namespace organbake
