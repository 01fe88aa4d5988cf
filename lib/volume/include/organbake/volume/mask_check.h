// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "organbake/volume/volume.h"

namespace organbake {

struct MaskCheckOptions {
  int label = 1;
  // A solid organ's tissue, with and without contrast agent, and the fat in it.
  double soft_tissue_min_hu = -150;
  double soft_tissue_max_hu = 300;
  double min_soft_tissue_share = 0.95;  // of the label's voxels inside the CT
  double max_deviation_hu = 120;        // standard deviation over the label

  void check() const;
};

// How well a label sits on the tissue that it claims to mark.
struct MaskFit {
  double soft_tissue_share = 0;  // 0…1
  double mean_hu = 0;
  double deviation_hu = 0;
};

// A place along the CT's slice axis where the label fits far better.
struct BetterPlace {
  int slices = 0;                    // CT slices to move the mask by, along +k
  Eigen::Vector3d shift_world_mm{};  // the same in the world: add it to the mask's origin_mm
  MaskFit fit;
};

struct MaskCheck {
  bool grids_equal = false;
  double overlap_share = 0;  // of the label's voxels that lie inside the CT
  MaskFit fit;
  std::optional<BetterPlace>
      better;  // searched for when the fit is not plausible and the grids differ
  bool plausible = false;
  std::string message;  // one or two sentences for the user; empty when all is well
};

// Tells whether a mask looks misplaced on its CT. A wrong header (a crop that kept the origin of
// the whole scan, say) is legal data: only the tissue below the label gives it away. The search for
// a better place slides the label along the slices and takes the smallest standard deviation, which
// a homogeneous organ shows only in its true place, and which must suit most of the mask's
// other labels, if any fit where they are. Throws BadDataError when the label is absent.
MaskCheck check_mask(const Volume& ct, const Volume& mask, const MaskCheckOptions& options);

}  // namespace organbake
