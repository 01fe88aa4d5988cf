// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/raycast/ray_scene.h"
#include "traced_mesh.h"

namespace organbake {

struct RayScene::Impl {
  explicit Impl(const TriangleMesh& traced) : mesh(traced) {}
  TracedMesh mesh;
};

}  // namespace organbake
