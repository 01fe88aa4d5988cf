// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace organbake {

// Which light the skin is drawn in.
enum class DrawnLight : std::uint8_t {
  baked,  // that its colours were taken in, wherever it is pushed
  world,  // the same lamps and sky, on the skin as it lies now
  scope,  // one light that travels with the view (ScopeLight)
};

const char* to_string(DrawnLight light);
std::optional<DrawnLight> drawn_light(std::string_view name);  // nothing for another name

}  // namespace organbake
