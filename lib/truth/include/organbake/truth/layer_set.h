// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// What can be told of every pixel of a picture beside its colour.
struct LayerSet {
  bool depth = false;    // planar z, mm, +inf at the background
  bool flow = false;     // to the next frame and the last one, px
  bool normals = false;  // camera axes, unit, towards the eye
  bool mask = false;     // labels of organs and instruments
  bool id = false;       // the skin point: organ, face, b1, b2, height
  bool weight = false;   // of the baked samples behind the colour

  bool any() const { return depth || flow || normals || mask || id || weight; }
  bool operator==(const LayerSet&) const = default;
};

// Their names, in that order.
const std::vector<std::string>& layer_names();
// "depth,mask" or "all". Throws UsageError for another name, saying which there are.
LayerSet layers_from(std::string_view text);

}  // namespace organbake
