// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Of a NIfTI affine whose steps are 1 mm where the header tells other voxel sizes besides.
enum class UnitAffine { refuse, keep, scale };

struct VolumeReadOptions {
  std::string series = {};  // of a DICOM folder: UID or number; empty = the one that is a CT volume
  // Refuse what would have to be mended: uneven gaps, missing, repeated or damaged slices.
  bool strict = false;
  // Only the voxels round this box of the world are kept, and only the slices that they need are
  // read.
  std::optional<Region> region = {};
  // Only where the voxels lie is asked for: a reader that can leaves their values out.
  bool grid_only = false;
  int time = 0;            // which of several time points, from 1; 0 = there must be only one
  bool any_time = false;   // without `time`, the first of several stands for all: for a look
  bool lasting = false;    // a volume of one time point alone stands for any `time`
  std::string label = {};  // of a mask: a number, a name, or several; empty = all as they are
  std::vector<LabelName> label_names = {};  // of a mask, instead of its file's own
  bool is_mask = false;                     // its values are labels: never interpolated
  // Of DICOM masks: the scan that they were made on, whose slices tell how thick their planes are.
  // Contours that follow its voxels become these.
  const Volume* scan = nullptr;
  UnitAffine unit_affine = UnitAffine::refuse;
  bool only_channels = false;  // of a mask of several volumes: they are no times, its CT has none
};

}  // namespace organbake
