// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/bundle/bundle.h"

namespace organbake {

// A bundle as a scene of SOFA (XML), in metres, kilograms and seconds, y up (scene_from_world):
// finite elements on the tetrahedra where there are any, else the proxy's springs; anchors; the
// proxy as collision model, and the surface, which lies beside it as OBJ, both mapped to what
// moves.
std::string sofa_text(const Bundle& bundle, const std::string& surface_file,
                      const std::string& color_file);

}  // namespace organbake
