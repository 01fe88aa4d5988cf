// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/registration/register_photo.h"

namespace organbake {

// The pose of a photograph that came with depth, near `start`: by depth alone first, then both in
// one problem, each with the weight that its own scatter says it has.
RegisteredPhoto register_with_depth(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                    const RigidTransform& start, const RegistrationOptions& options,
                                    const RunContext& context);

}  // namespace organbake
