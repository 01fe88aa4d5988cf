// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/mesh_files.h"
#include "pipelines/options.h"

namespace organbake {

void bind_unit(OptionList& list, MeshUnit& unit,
               const char* help = "of a mesh file that doesn't say its own; glTF is in metres");

}  // namespace organbake
