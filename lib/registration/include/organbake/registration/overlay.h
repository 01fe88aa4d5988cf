// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/registration/register_photo.h"

namespace organbake {

// What a person judges a pose by at a glance: the photograph with the organ's outline in green
// (yellow when doubtful, red when failed), and on the organ a checkerboard that shows the predicted
// shading in every other field. At most 1600 pixels a side.
Rgb8Image draw_overlay(const RegisteredSurface& surface, const Rgb8Image& photo,
                       const RegisteredPhoto& registered, const RegistrationOptions& options);

}  // namespace organbake
