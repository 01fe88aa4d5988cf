// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gl_names.h"
#include "organbake/warp/warper.h"
#include "program.h"

namespace organbake {

// The light that an organ is drawn in, for the shaders (light.glsl).
class SkinLightUniforms {
 public:
  // options.light, or as baked where the organ knows no other; reference_mm: of full exposure.
  void set(const Program& program, const Warper& warper, const Lighting* lighting, const View& view,
           DrawnLight light, double reference_mm);

 private:
  void set_scope(const Program& program, const ScopeShading& shading, const SkinFinish& finish);
  void fill_noise();

  TextureName noise_;
  bool has_noise_ = false;
};

}  // namespace organbake
