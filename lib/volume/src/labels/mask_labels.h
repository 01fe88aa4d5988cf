// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {

// What a text such as "5", "liver" or "5,7" or "spleen, liver" asks for, called "liver" or "label
// 5"; what else has one name in `with`, without a name: numbers, or names without regard to case
// and to '_', '-' and spaces. Throws BadDataError naming the labels that there are for a name that
// isn't there, for one that several have, and for a number that several layers have; UsageError for
// a number beyond 1…16777216. That voxels have the label is not looked at here.
std::vector<LabelName> chosen_labels(const std::string& text, const std::vector<LabelName>& names,
                                     const std::string& file);

// Makes options.label one label of the mask: volume.chosen_label. Of several labels the voxels all
// get the first one's number. Throws BadDataError when one of several is absent.
void choose_label(Volume& mask, const VolumeReadOptions& options, const std::string& file);

// One mask from a file of several layers, of which `read_one` reads one: options.label out of its
// layer or layers, as the first one's number; without options.label, the layers over one another.
// Throws BadDataError also when the layers that are asked for lie on different grids.
Volume read_layers(std::int64_t layers, const VolumeReadOptions& options, const std::string& file,
                   const std::vector<LabelName>& names,
                   const std::function<Volume(std::int64_t)>& read_one);

// The same where each layer is a mask of its own: every voxel of it that is not 0 gets the number
// that `names` gives the layer. Names choose; numbers, which mean nothing there, are refused with
// `advice`, unless there is but one layer.
Volume read_separate_masks(const VolumeReadOptions& options, const std::string& file,
                           const std::vector<LabelName>& names, const std::string& advice,
                           const std::function<Volume(std::int64_t)>& read_one);

}  // namespace organbake
