// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "phantom/laparoscopy.h"
#include "phantom/phantom.h"
#include "pipelines/options.h"

namespace organbake {

struct PhantomStageOptions {
  std::string kind = "organ";
  OrganPhantomOptions organ;
  int truth_subdivisions = 7;
  LaparoscopyOptions laparoscopy;
};

void bind(OptionList& list, PhantomStageOptions& options);

}  // namespace organbake
