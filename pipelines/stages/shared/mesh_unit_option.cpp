// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/shared/mesh_unit_option.h"

namespace organbake {

void bind_unit(OptionList& list, MeshUnit& unit, const char* help) {
  list.add(
      "unit", &unit, {.help = help},
      {{"mm", MeshUnit::mm}, {"cm", MeshUnit::cm}, {"m", MeshUnit::m}, {"in", MeshUnit::inch}});
}

}  // namespace organbake
