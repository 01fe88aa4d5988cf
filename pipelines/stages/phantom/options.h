// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/options/options.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/phantom/phantom.h"

namespace organbake {

struct PhantomStageOptions {
  std::string kind = "organ";
  OrganPhantomOptions organ;
  int truth_subdivisions = 7;
  LaparoscopyOptions laparoscopy;
  // Of a laparoscopy; 0 = what its path asks for.
  int frames = 0, frame_width = 0, frame_height = 0;
  std::string path = "sway";
  MovingClipOptions clip;  // for all paths but `sway`; its view comes from `laparoscopy`
  double bit_rate_mbps = 0;

  bool moves_along_path() const { return path != "sway"; }
  LaparoscopyOptions view() const;        // of either kind of clip
  MovingClipOptions moving_clip() const;  // where it moves along a path
};

void bind(OptionList& list, PhantomStageOptions& options);

}  // namespace organbake
