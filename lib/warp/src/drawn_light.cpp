// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/drawn_light.h"

namespace organbake {

const char* to_string(DrawnLight light) {
  switch (light) {
    case DrawnLight::baked:
      return "baked";
    case DrawnLight::world:
      return "world";
    case DrawnLight::scope:
      return "scope";
  }
  return "?";
}

std::optional<DrawnLight> drawn_light(std::string_view name) {
  for (const DrawnLight light : {DrawnLight::baked, DrawnLight::world, DrawnLight::scope})
    if (name == to_string(light)) return light;
  return std::nullopt;
}

}  // namespace organbake
