// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/options/options.h"

namespace organbake {

// Declared alone: a stage that reads no clips has none of their headers.
struct DepthMeshOptions;
struct MeshFrame;
struct SelectionOptions;
enum class MeshUnit;

// The unit and the axes of mesh files that don't say theirs; in a bake, those of its inputs.
void bind(OptionList& list, MeshFrame& frame);
// The unit of other files.
void bind_unit(OptionList& list, MeshUnit& unit, const char* help);

// Of the stages that read a clip: which of its frames, and the one that becomes a surface.
// selection_of() throws UsageError where both say which frames are taken.
SelectionOptions selection_of(int every, int sharpest);
void bind_frames(OptionList& list, int& every, int& sharpest);
void bind_key_frame(OptionList& list, bool& keep_light, bool& strict, DepthMeshOptions& mesh);

}  // namespace organbake
