// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/camera_maps.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/bundle/manifest.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/geometry/shell_surface.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct Bundle {
  Manifest manifest;
  TriangleMesh proxy;
  CameraSet cameras;
  MechanicsModel mechanics;
  std::vector<CameraMaps> maps;  // one per camera; those not read yet are empty (width 0)
  BaseLayer base;
  std::optional<Lighting> lighting;  // that the colours were taken in, when it is known
  std::optional<SmoothSkin> skin;    // over the proxy; samples are then bound to it

  // What samples and base layer are bound to. Throws BadDataError when skin and proxy don't fit.
  ShellSurface shell() const { return ShellSurface(proxy, skin); }
};

// How many faces the shell's surface has: what maps and base layer number.
inline std::size_t shell_face_count(const Bundle& bundle) {
  return bundle.proxy.faces.size() * (bundle.skin ? bundle.skin->faces_per_proxy_face() : 1);
}

}  // namespace organbake
