// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/options/options.h"
#include "organbake/shading/depth_mesh.h"
#include "organbake/shading/frame_source.h"

namespace organbake {

// Of the stages that read a clip: which of its frames, and the one that becomes a surface.
// selection_of() throws UsageError where both say which frames are taken.
SelectionOptions selection_of(int every, int sharpest);
void bind_frames(OptionList& list, int& every, int& sharpest);
void bind_key_frame(OptionList& list, bool& keep_light, bool& strict, int& mesh_frame,
                    DepthMeshOptions& mesh);

}  // namespace organbake
