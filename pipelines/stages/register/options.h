// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

// Which files a pose is written to besides our own.
enum class CameraExport { none, colmap, transforms };

struct RegisterStageOptions {
  RegistrationOptions registration;
  bool closed_outline = false;  // the organ ends where the mesh does
  bool vertex_albedo = false;   // the surface's colours are its albedo
  bool from_poses = false;      // start from the poses that the document of unposed photos has
  CameraExport also = CameraExport::none;
  MeshFrame frame;
};

void bind(OptionList& list, RegisterStageOptions& options);

}  // namespace organbake
